// Arguments are not converted: an array of another data type, number of axes or, for two axes and more, memory order than stated is
// a TypeError; arrays whose shapes do not fit each other are a ValueError. Arrays with one axis may have any stride; `coords` and
// the points of one polyline may have any layout; all others are in C order. Results own their memory.
//
// The letters of shapes mean the same in all kernels: N points or pixels, P points of a polyline, D in {2, 3} coordinates, S samples
// along center lines, J joints, C chains, E = 2 C ends of chains (ends 2 c and 2 c + 1 are the first and the last end of chain c), M
// voxels, K pixels or voxels of a skeleton, B branches, (H, W) rows and columns of an image. Lengths are in the unit of the
// coordinates: metres in 3-D, pixels in 2-D.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/tuple.h>

// and the standard library for all kernels
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "documented.h"

// A second version of a loop for processors with AVX2, where the compiler and the C library choose at load time.
#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) && defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__)
#define WITH_AVX2 __attribute__((target_clones("avx2", "default")))
#else
#define WITH_AVX2
#endif

// The next loop, of up to eight rounds that the compiler can count, without jumps.
#if defined(__GNUC__) && !defined(__clang__)
#define UNROLLED _Pragma("GCC unroll 8")
#else
#define UNROLLED
#endif

namespace nb = nanobind;
using namespace nb::literals;

using Index = std::int64_t;
constexpr Index CHANNELS = 3;  // of a color image
const double PI = std::acos(-1.0);

// The name of an argument that is an array, which is not converted.
inline auto operator""_array(const char* name, std::size_t) { return nb::arg(name).noconvert(); }

// Add to the elements that the kernels looked at in this thread, which `visits` returns: pixels, points, voxels, cells, or pairs of
// them. The fixed neighborhood of a pixel or voxel belongs to it. A kernel adds what its loops took, once for a loop, in the thread
// that called it.
void count_visits(Index count);

// Add the bytes of an image or table that is cleared or searched, eight at a time.
inline void count_bytes(Index bytes) { count_visits(bytes / 8); }

// The elements that nested loops look at, added when the scope ends.
struct Visits {
    Index count = 0;
    ~Visits() { count_visits(count); }
};

// inputs
template <class T>
using Vector = nb::ndarray<const T, nb::ndim<1>, nb::device::cpu>;  // of any stride, such as a column
template <class T>
using Matrix = nb::ndarray<const T, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
template <class T>
using StridedMatrix = nb::ndarray<const T, nb::ndim<2>, nb::device::cpu>;  // of any layout, read by (row, column)
template <class T>
using Volume = nb::ndarray<const T, nb::ndim<3>, nb::c_contig, nb::device::cpu>;

// results: a vector becomes an array (size,). Kernels run without Python's lock, see `documented.h`; what they return becomes an array
// afterwards, whose memory is that of the vector.

// Values of an array of N axes in C order; the elements may have another type for Python: bytes that are 0 or 1 are bool.
template <class T, std::size_t N, class Element = T>
struct Array {
    std::vector<T> values;
    std::array<std::size_t, N> shape;
};

using Byte = std::uint8_t;  // a bool of NumPy may hold any byte

template <class T, class... Sizes>
Array<T, sizeof...(Sizes)> shaped(std::vector<T>&& values, Sizes... sizes) {
    return {std::move(values), {std::size_t(sizes)...}};
}

// Return values as an array (N, columns).
template <class T>
Array<T, 2> rows_of(std::vector<T>&& values, std::size_t columns) {
    const std::size_t rows = values.size() / columns;
    return {std::move(values), {rows, columns}};
}

inline Array<Byte, 1, bool> flags(std::vector<Byte>&& values) {
    const std::size_t size = values.size();
    return {std::move(values), {size}};
}

namespace nanobind::detail {
template <class T, std::size_t N, class Element>
struct type_caster<Array<T, N, Element>> {
    using Value = Array<T, N, Element>;
    using Numpy = ndarray<numpy, Element, ndim<N>, c_contig>;
    static constexpr auto Name = make_caster<Numpy>::Name;

    static handle from_cpp(Value&& array, rv_policy, cleanup_list* cleanup) noexcept {
        auto* kept = new std::vector<T>(std::move(array.values));
        const capsule owner(kept, [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
        const Numpy result(reinterpret_cast<Element*>(kept->data()), N, array.shape.data(), owner);
        return make_caster<Numpy>::from_cpp(result, rv_policy::automatic, cleanup);
    }
};

template <class T>
struct type_caster<std::vector<T>> {
    using Value = std::vector<T>;
    static constexpr auto Name = make_caster<Array<T, 1>>::Name;

    static handle from_cpp(Value&& values, rv_policy policy, cleanup_list* cleanup) noexcept {
        const std::size_t size = values.size();
        return make_caster<Array<T, 1>>::from_cpp({std::move(values), {size}}, policy, cleanup);
    }
};
}  // namespace nanobind::detail

template <class T>
std::vector<T> dense(const Vector<T>& values) {
    std::vector<T> result(values.shape(0));
    for (std::size_t i = 0; i < result.size(); ++i) result[i] = values(i);
    return result;
}

// Return the rows of a matrix of any layout one after the other.
template <class T>
std::vector<T> dense(const StridedMatrix<T>& matrix) {
    const std::size_t rows = matrix.shape(0), columns = matrix.shape(1);
    count_visits(Index(rows));
    std::vector<T> values(rows * columns);
    for (std::size_t i = 0; i < rows; ++i) {
        for (std::size_t j = 0; j < columns; ++j) values[i * columns + j] = matrix(i, j);
    }
    return values;
}

// Refuse arrays whose shapes do not fit each other.
inline void require(bool condition, const char* sentence) {
    if (!condition) throw nb::value_error(sentence);
}

// Refuse bounds (C + 1,) that do not divide `count` rows into C parts, one after the other.
inline void check_bounds(const Vector<Index>& bounds, Index count) {
    require(bounds.shape(0) > 0 && bounds(0) == 0, "bounds do not start at 0");
    for (std::size_t k = 1; k < bounds.shape(0); ++k) require(bounds(k) >= bounds(k - 1), "bounds are not ascending");
    require(bounds(bounds.shape(0) - 1) == count, "bounds do not end at the number of points");
}

// Return the points of a polyline one after the other; refuse none, and coordinates that are not finite.
inline std::vector<double> finite_points(const StridedMatrix<double>& points) {
    require(points.shape(0) > 0 && points.shape(1) > 0, "points are empty, expected at least one");
    std::vector<double> values = dense(points);
    for (const double value : values) require(std::isfinite(value), "a coordinate is not finite");
    return values;
}

// Python's min and max: of equal values the first.
template <class T>
T least(T a, T b) {
    return b < a ? b : a;
}
template <class T>
T most(T a, T b) {
    return b > a ? b : a;
}

// Return the squared distance between two points of `dim` coordinates.
inline double squared_distance(const double* a, const double* b, Index dim) {
    double sum = 0.0;
    for (Index d = 0; d < dim; ++d) {
        const double step = a[d] - b[d];
        sum += step * step;
    }
    return sum;
}

inline const Byte* bytes_of(const Matrix<bool>& mask) { return reinterpret_cast<const Byte*>(mask.data()); }

// Return the first index in [begin, end) whose byte is not 0, or end; 32 and then eight bytes at a time.
inline Index first_set(const Byte* bytes, Index begin, Index end) {
    for (std::uint64_t four[4]; begin + 32 <= end; begin += 32) {
        std::memcpy(four, bytes + begin, 32);
        if (four[0] | four[1] | four[2] | four[3]) break;
    }
    for (std::uint64_t word; begin + 8 <= end; begin += 8) {
        std::memcpy(&word, bytes + begin, 8);
        if (word) break;
    }
    while (begin < end && !bytes[begin]) ++begin;
    return begin;
}

// Call `visit` with the row-major index of each True pixel of a mask, in ascending order.
template <class Visit>
void for_each_set(const Matrix<bool>& mask, Visit visit) {
    const Byte* bytes = bytes_of(mask);
    const Index end = mask.shape(0) * mask.shape(1);
    Visits visits{end / 8};
    for (Index i = first_set(bytes, 0, end); i < end; i = first_set(bytes, i, end)) {
        const Index begin = i;
        for (; i < end && bytes[i]; ++i) visit(i);
        visits.count += i - begin;
    }
}
