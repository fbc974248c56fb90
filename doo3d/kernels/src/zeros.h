// Images of zeros that are used again: who borrows one clears what it wrote, so that nothing costs what the image costs.
#pragma once

#include "arrays.h"

template <class T>
class Zeros {
public:
    explicit Zeros(Index size) {
        std::vector<std::vector<T>>& kept = pool();
        if (!kept.empty()) {
            image_ = std::move(kept.back());
            kept.pop_back();
        }
        if (Index(image_.size()) < size) image_.resize(size);
    }

    ~Zeros() {
        if (image_.size() * sizeof(T) <= MOST_BYTES) pool().push_back(std::move(image_));
    }

    Zeros(const Zeros&) = delete;
    Zeros& operator=(const Zeros&) = delete;

    T* data() { return image_.data(); }
    const T* data() const { return image_.data(); }

private:
    static constexpr std::size_t MOST_BYTES = 1 << 24;  // of an image that is kept

    static std::vector<std::vector<T>>& pool() {
        thread_local std::vector<std::vector<T>> kept;
        return kept;
    }

    std::vector<T> image_;
};
