// Maximum-weight matching of few members: pairs that are sure, and all subsets of what is left.
#include "arrays.h"

namespace {

void check(const Matrix<double>& weight) { require(weight.shape(0) == weight.shape(1), "weight is not square"); }

// A pair that weighs at least as much as the best others of both its members together belongs to a matching of largest
// weight: wherever it is missing, it may take their place. Without the members more pairs do.
auto settle_dominant_pairs(Matrix<double> weight) {
    check(weight);
    const Index count = weight.shape(0);
    std::vector<Index> partner(count, -1);
    std::vector<std::uint8_t> left(count, 1);
    for (bool changed = true; changed;) {
        changed = false;
        for (Index a = 0; a < count; ++a) {
            if (!left[a]) continue;
            Index b = -1;
            double heaviest = 0.0, second = 0.0, third = 0.0;
            for (Index end = 0; end < count; ++end) {
                if (!left[end]) continue;
                const double w = weight(a, end);
                if (w > heaviest) {
                    second = heaviest;
                    heaviest = w;
                    b = end;
                } else if (w > second) {
                    second = w;
                }
            }
            if (b < 0) {
                left[a] = 0;
                continue;
            }
            for (Index end = 0; end < count; ++end) {
                if (left[end] && end != a && weight(b, end) > third) third = weight(b, end);
            }
            if (heaviest >= second + third) {
                partner[a] = b;
                partner[b] = a;
                left[a] = left[b] = 0;
                changed = true;
            }
        }
    }
    std::vector<Index> component(count, -1), stack;
    Index components = 0;
    for (Index seed = 0; seed < count; ++seed) {
        if (!left[seed] || component[seed] >= 0) continue;
        component[seed] = components;
        stack.assign(1, seed);
        while (!stack.empty()) {
            const Index a = stack.back();
            stack.pop_back();
            for (Index b = 0; b < count; ++b) {
                if (left[b] && weight(a, b) > 0 && component[b] < 0) {
                    component[b] = components;
                    stack.push_back(b);
                }
            }
        }
        ++components;
    }
    return std::make_tuple(to_numpy(std::move(partner)), to_numpy(std::move(component)));
}

// total[s] is the largest weight of a matching of the subset s of the members, from those of its subsets without the last member.
auto match_by_subsets(Matrix<double> weight) {
    check(weight);
    const Index count = weight.shape(0);
    require(count <= 24, "there are more than 24 members: all their subsets do not fit the memory");
    std::vector<double> total(std::size_t(1) << count);
    for (Index last = 0; last < count; ++last) {
        for (Index rest = 0; rest < Index(1) << last; ++rest) {
            double heaviest = total[rest];
            for (Index end = 0; end < last; ++end) {
                if (rest >> end & 1 && weight(last, end) != 0) {
                    heaviest = most(heaviest, total[rest ^ Index(1) << end] + weight(last, end));
                }
            }
            total[rest | Index(1) << last] = heaviest;
        }
    }
    std::vector<Index> partner(count, -1);
    Index chosen = (Index(1) << count) - 1;
    for (Index last = count - 1; last >= 0; --last) {
        if (!(chosen >> last & 1)) continue;
        const double heaviest = total[chosen];
        chosen ^= Index(1) << last;
        if (heaviest == total[chosen]) continue;
        for (Index other = 0; other < last; ++other) {
            if (chosen >> other & 1 && total[chosen ^ Index(1) << other] + weight(last, other) >= heaviest) {
                partner[last] = other;
                partner[other] = last;
                chosen ^= Index(1) << other;
                break;
            }
        }
    }
    return to_numpy(std::move(partner));
}

}  // namespace

void bind_matching(nb::module_& m) {
    m.def("settle_dominant_pairs", &settle_dominant_pairs, "weight"_a.noconvert());
    m.def("match_by_subsets", &match_by_subsets, "weight"_a.noconvert());
}
