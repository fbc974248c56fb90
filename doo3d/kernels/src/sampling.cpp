// Images looked up between their pixels.
#include "arrays.h"

template <class T>
static auto sample_bilinear(Volume<T> image, Matrix<double> positions) {
    const Index height = image.shape(0), width = image.shape(1), channels = image.shape(2), count = positions.shape(0);
    require(count == 0 || positions.shape(1) == 2, "positions are not (N, 2)");
    count_visits(count);
    std::vector<double> values(count * channels, NAN);
    for (Index n = 0; n < count; ++n) {
        const double x = positions(n, 0), y = positions(n, 1);
        if (!(0 <= x && 0 <= y)) continue;
        const double left = std::floor(x), top = std::floor(y);
        if (!(left + 1 < double(width) && top + 1 < double(height))) continue;
        const Index u = Index(left), v = Index(top);
        const double right_weight = x - left, lower_weight = y - top;
        const T* upper_row = image.data() + (v * width + u) * channels;
        const T* lower_row = upper_row + width * channels;
        for (Index k = 0; k < channels; ++k) {
            const double upper = double(upper_row[k]) * (1 - right_weight) + double(upper_row[k + channels]) * right_weight;
            const double lower = double(lower_row[k]) * (1 - right_weight) + double(lower_row[k + channels]) * right_weight;
            values[n * channels + k] = upper * (1 - lower_weight) + lower * lower_weight;
        }
    }
    return to_numpy(std::move(values), count, channels);
}

void bind_sampling(nb::module_& m) {
    m.def("sample_bilinear", &sample_bilinear<std::uint8_t>, "image"_a.noconvert(), "positions"_a.noconvert());
    m.def("sample_bilinear", &sample_bilinear<double>, "image"_a.noconvert(), "positions"_a.noconvert());
}
