// The least rise of the total cost of a matching of ends without one of its connections: up to three connections are exchanged.
#include "arrays.h"

#include <algorithm>

#include <array>

namespace {

// Ends that an exchange joins, and the ends whose connections it breaks.
struct Exchange {
    double rise;
    int made_count = 0, broken_count = 0;
    std::array<std::array<Index, 2>, 4> made{};
    std::array<Index, 6> broken{};

    void join(Index a, Index b) { made[made_count++] = {a, b}; }
    void break_up(Index a, Index b) {
        broken[broken_count++] = a;
        broken[broken_count++] = b;
    }
    bool joins_to(Index end) const {
        for (int m = 0; m < made_count; ++m) {
            if (made[m][1] == end) return true;
        }
        return false;
    }
};

// A matching of E ends, by the cost of joining any two.
class Matching {
public:
    Matching(Matrix<double> cost, Vector<Index> partner, double free_cost, Vector<Index> free_partner, Vector<double> release)
        : cost_(cost), partner_(partner), free_partner_(free_partner), release_(release), free_cost_(free_cost), count_(cost.shape(0)) {
        require(Index(cost.shape(1)) == count_, "cost is not square");
        require(Index(partner.shape(0)) == count_ && Index(free_partner.shape(0)) == count_ && Index(release.shape(0)) == count_,
                "partner, free_partner and release are not one per end");
        for (Index e = 0; e < count_; ++e) {
            require(partner(e) >= -1 && partner(e) < count_ && free_partner(e) >= -1 && free_partner(e) < count_, "partner or free_partner is no end");
        }
    }

    // Return the least rise without the connection of ends a and b, at most that of leaving both free.
    double rise_without(Index a, Index b, bool allow_closed) {
        double least_rise = free_cost_ - cost_(a, b);
        fill_bounds(a, b);
        for (;;) {
            const Index c = lowest(row_least_.data(), count_ + 1), d = row_column_[c];
            if (!(row_least_[c] < least_rise)) return least_rise;
            bound(c, d) = INFINITY;
            update_row(c);
            const Exchange exchange = exchange_for(a, b, c < count_ ? c : -1, d < count_ ? d : -1);
            if (exchange.rise < least_rise && (allow_closed || !closes_ring(exchange))) least_rise = exchange.rise;
        }
    }

private:
    double& bound(Index c, Index d) { return bounds_[c * (count_ + 1) + d]; }

    static Index lowest(const double* values, Index size) {
        Index index = 0;
        for (Index k = 0; k < size; ++k) {
            if (values[k] < values[index]) index = k;
        }
        return index;
    }

    void update_row(Index c) {
        row_column_[c] = lowest(&bound(c, 0), count_ + 1);
        row_least_[c] = bound(c, row_column_[c]);
    }

    // Fill in the least by which the total rises when a is joined to end c and b to end d instead; the last is none.
    void fill_bounds(Index a, Index b) {
        bounds_.assign((count_ + 1) * (count_ + 1), 0.0);
        row_column_.resize(count_ + 1);
        row_least_.resize(count_ + 1);
        for (Index c = 0; c <= count_; ++c) {
            for (Index d = 0; d <= count_; ++d) bound(c, d) = bound_of(a, b, c, d);
            update_row(c);
        }
    }

    double bound_of(Index a, Index b, Index c, Index d) const {
        if ((c == d && c < count_) || c == a || c == b || d == a || d == b) return INFINITY;
        const double first = c < count_ ? cost_(a, c) + release_(c) : free_cost_ / 2;
        const double second = d < count_ ? cost_(b, d) + release_(d) : free_cost_ / 2;
        const double rise = first + second - cost_(a, b);
        if (c == count_ || d == count_ || partner_(c) < 0 || partner_(d) < 0) return rise;
        const Index e = partner_(c), f = partner_(d);
        if (d == e) return cost_(a, c) + cost_(b, d) - cost_(c, d) - cost_(a, b);
        const double apart = release_(c) + cost_(c, e) + release_(d) + cost_(d, f);
        return rise + least(cost_(e, f) - apart, 0.0);
    }

    // Return the exchange in which a is joined to c and b to d, -1 being none, and their former partners elsewhere.
    Exchange exchange_for(Index a, Index b, Index c, Index d) const {
        Exchange exchange{};
        exchange.break_up(a, b);
        double before = cost_(a, b);
        const Index low = std::min(c, d), high = std::max(c, d);
        if (c >= 0) exchange.join(a, c);
        if (d >= 0) exchange.join(b, d);
        std::array<Index, 2> left{};
        int left_count = 0;
        for (const Index end : {low, high}) {
            if (end < 0 || partner_(end) < 0 || (end == high && partner_(end) == low)) continue;
            const Index other = partner_(end);
            before += cost_(end, other);
            exchange.break_up(end, other);
            if (other != high) left[left_count++] = other;
        }
        if (left_count == 2 && cost_(left[0], left[1]) < free_cost_) {
            exchange.join(left[0], left[1]);
        } else {
            for (int k = 0; k < left_count; ++k) {
                const Index end = free_partner_(left[k]);
                if (end >= 0 && !exchange.joins_to(end)) exchange.join(left[k], end);
            }
        }
        double after = 0.0;
        for (int m = 0; m < exchange.made_count; ++m) after += cost_(exchange.made[m][0], exchange.made[m][1]);
        exchange.rise = after - before + double(exchange.broken_count - 2 * exchange.made_count) * free_cost_ / 2;
        return exchange;
    }

    // Tell whether an exchange closes a ring of chains; ends e and e ^ 1 are those of one chain.
    bool closes_ring(const Exchange& exchange) const {
        std::vector<Index> now(count_);
        for (Index e = 0; e < count_; ++e) now[e] = partner_(e);
        for (int k = 0; k < exchange.broken_count; ++k) now[exchange.broken[k]] = -1;
        for (int m = 0; m < exchange.made_count; ++m) {
            now[exchange.made[m][0]] = exchange.made[m][1];
            now[exchange.made[m][1]] = exchange.made[m][0];
        }
        for (int m = 0; m < exchange.made_count; ++m) {
            const Index start = exchange.made[m][0];
            Index end = start ^ 1;
            while (now[end] >= 0 && now[end] != start) end = now[end] ^ 1;
            if (now[end] >= 0) return true;
        }
        return false;
    }

    Matrix<double> cost_;
    Vector<Index> partner_, free_partner_;
    Vector<double> release_;
    double free_cost_;
    Index count_;
    std::vector<double> bounds_, row_least_;
    std::vector<Index> row_column_;
};

auto second_best_rise(Matrix<double> cost, Vector<Index> partner, double free_cost, Vector<Index> free_partner, Vector<double> release,
                      Matrix<Index> pairs, bool allow_closed) {
    const Index ends = cost.shape(0);
    require(ends % 2 == 0, "the number of ends is odd");
    require(pairs.shape(1) == 2, "pairs are not (K, 2)");
    Matching matching(cost, partner, free_cost, free_partner, release);
    std::vector<double> rises(pairs.shape(0));
    for (std::size_t k = 0; k < rises.size(); ++k) {
        require(pairs(k, 0) >= 0 && pairs(k, 0) < ends && pairs(k, 1) >= 0 && pairs(k, 1) < ends, "a pair holds no end");
        rises[k] = matching.rise_without(pairs(k, 0), pairs(k, 1), allow_closed);
    }
    return to_numpy(std::move(rises));
}

}  // namespace

void bind_second_best(nb::module_& m) {
    m.def("second_best_rise", &second_best_rise, "cost"_a.noconvert(), "partner"_a.noconvert(), "free_cost"_a, "free_partner"_a.noconvert(),
          "release"_a.noconvert(), "pairs"_a.noconvert(), "allow_closed"_a);
}
