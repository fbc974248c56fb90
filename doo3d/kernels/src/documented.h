// Bindings whose docstrings are the comments above them, as `backend/docstrings.py` reads them when the kernels are built.
//
// Functions run without Python's lock (GIL), so that other threads run: they make and touch no Python object.
#pragma once

#include <nanobind/nanobind.h>

#include <string>
#include <utility>

using WithoutGil = nanobind::call_guard<nanobind::gil_scoped_release>;

// Return the docstring of a function, a class or `Class.method`, and with an empty name that of the module.
const char* docstring(const std::string& name);

// A Python module whose functions are bound with docstrings.
struct Module : nanobind::module_ {
    explicit Module(const nanobind::module_& module) : nanobind::module_(module) { doc() = docstring(""); }

    template <class Function, class... Extra>
    void def(const char* name, Function&& function, const Extra&... extra) {
        nanobind::module_::def(name, std::forward<Function>(function), extra..., WithoutGil(), docstring(name));
    }
};

// A class of the module whose methods and properties are bound with docstrings; the docstring of the class covers the constructor.
template <class T>
class Class : public nanobind::class_<T> {
    using Base = nanobind::class_<T>;

public:
    Class(Module& module, const char* name) : Base(module, name, docstring(name)), name_(name) {}

    template <class... Arguments, class... Extra>
    Class& def(nanobind::init<Arguments...> constructor, const Extra&... extra) {
        Base::def(std::move(constructor), extra..., WithoutGil());
        return *this;
    }
    template <class Function, class... Extra>
    Class& def(const char* name, Function&& method, const Extra&... extra) {
        Base::def(name, std::forward<Function>(method), extra..., WithoutGil(), docstring(name_ + "." + name));
        return *this;
    }
    template <class Getter, class... Extra>
    Class& def_prop_ro(const char* name, Getter&& getter, const Extra&... extra) {
        Base::def_prop_ro(name, std::forward<Getter>(getter), extra..., docstring(name_ + "." + name));
        return *this;
    }
    template <class Member>
    Class& def_ro(const char* name, Member member) {
        Base::def_ro(name, member, docstring(name_ + "." + name));
        return *this;
    }

private:
    std::string name_;
};
