// The least rise of the total cost of a matching of ends without one of its connections: up to three connections are exchanged.
#include "arrays.h"

#include <algorithm>
#include <array>
#include <queue>

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
    // given : cost of joining ends a < b. joined, joined_costs : the connections and what they cost.
    Matching(Matrix<double> given, Matrix<Index> joined, Vector<double> joined_costs, double free_cost, Index alternatives)
        : count_(given.shape(0)), free_cost_(free_cost), alternatives_(alternatives), total_(count_ * count_), partner_(count_, -1) {
        require(Index(given.shape(1)) == count_ && count_ % 2 == 0, "cost is not square, or the number of ends is odd");
        require(joined.shape(1) == 2 && joined.shape(0) == joined_costs.shape(0), "joined is not (K, 2), or has other costs");
        count_visits(count_ * count_);
        for (Index e = 0; e < count_ * count_; ++e) {
            const double lower = least(given.data()[e], given.data()[e % count_ * count_ + e / count_]);
            total_[e] = lower > free_cost ? INFINITY : lower;
        }
        for (std::size_t k = 0; k < joined.shape(0); ++k) {
            const Index a = joined(k, 0), b = joined(k, 1);
            require(a >= 0 && a < count_ && b >= 0 && b < count_, "a pair holds no end");
            partner_[a] = b, partner_[b] = a;
            total_[a * count_ + b] = total_[b * count_ + a] = joined_costs(k);
        }
        find_spare_ends();
        cheapest_.assign(count_, INFINITY);
        double largest = std::fabs(free_cost);
        for (Index e = 0; e < count_; ++e) {
            for (Index f = 0; f < count_; ++f) {
                if (cost(e, f) < cheapest_[e]) cheapest_[e] = cost(e, f);
                if (std::isfinite(cost(e, f))) largest = std::max(largest, std::fabs(cost(e, f)));
            }
            if (std::isfinite(release_[e])) largest = std::max(largest, std::fabs(release_[e]));
        }
        tolerance_ = 1e-12 * largest;
    }

    // Return the least rise without the connection of ends a and b, at most that of leaving both free.
    //
    // The exchanges are tried by the least that each may cost, its bound. To compute few of the E^2 bounds, those are computed first
    // whose estimates are low: sums of a share of each of the two ends.
    double rise_without(Index a, Index b, bool allow_closed) {
        double least_rise = free_cost_ - cost(a, b);
        estimate(a, b, rows_);
        estimate(b, a, columns_);
        bounds_ = {};
        estimates_ = {};
        add_swaps(a, b);
        add_estimate(0, 0);
        for (;;) {
            while (!estimates_.empty() && (bounds_.empty() || estimates_.top().value - cost(a, b) - tolerance_ <= bounds_.top().value)) {
                const Option next = estimates_.top();
                estimates_.pop();
                count_visits(1);
                if (next.value - cost(a, b) - tolerance_ >= least_rise) {
                    estimates_ = {};
                    break;
                }
                add_estimate(next.first, next.second + 1);
                if (next.second == 0) add_estimate(next.first + 1, 0);
                const Index c = rows_[next.first].end, d = columns_[next.second].end;
                if (c == count_ || d == count_ || partner_[c] != d) add_bound(a, b, c, d);
            }
            if (bounds_.empty()) return least_rise;
            const Option lowest = bounds_.top();
            bounds_.pop();
            if (!(lowest.value < least_rise)) return least_rise;
            const Exchange exchange = exchange_for(a, b, lowest.first < count_ ? lowest.first : -1, lowest.second < count_ ? lowest.second : -1);
            if (exchange.rise < least_rise && (allow_closed || !closes_ring(exchange))) least_rise = exchange.rise;
        }
    }

private:
    double cost(Index a, Index b) const { return total_[a * count_ + b]; }

    // Find the free end that each end would be joined to at the least cost, -1 where none is worth it, and the cost of taking each
    // end away from what it is joined to, or from being free.
    void find_spare_ends() {
        std::vector<double> spare_cost(count_, INFINITY);
        free_partner_.assign(count_, -1);
        release_.assign(count_, -free_cost_ / 2);
        for (Index e = 0; e < count_; ++e) {
            for (Index f = 0; f < count_; ++f) {
                if (partner_[f] >= 0 || !(cost(e, f) < spare_cost[e])) continue;
                spare_cost[e] = cost(e, f);
                if (spare_cost[e] < free_cost_) free_partner_[e] = f;
            }
        }
        for (Index e = 0; e < count_; ++e) {
            if (partner_[e] < 0) continue;
            release_[e] = least(free_cost_ / 2, spare_cost[partner_[e]] - free_cost_ / 2) - cost(e, partner_[e]);
        }
    }

    // The least that joining an end to another end, or to none, adds to the rise.
    struct Estimate {
        double value;
        Index end;
        bool operator<(const Estimate& other) const { return value < other.value; }
    };
    // A pair of ends or of places in lists. The top of a priority queue is the largest: the lowest value, of equal ones the first pair.
    struct Option {
        double value;
        Index first, second;
        bool operator<(const Option& other) const {
            if (value != other.value) return value > other.value;
            return first != other.first ? first > other.first : second > other.second;
        }
    };

    // Estimate the share of each end that an end may be joined to instead, the lowest first; the end `count_` is none.
    void estimate(Index end, Index other, std::vector<Estimate>& shares) const {
        shares.clear();
        count_visits(count_);
        for (Index c = 0; c < count_; ++c) {
            if (c == end || c == other || !(cost(end, c) < INFINITY)) continue;
            double share = cost(end, c) + release_[c];
            if (partner_[c] >= 0) share += least(cheapest_[partner_[c]] / 2 - release_[c] - cost(c, partner_[c]), 0.0);
            if (share < INFINITY) shares.push_back({share, c});
        }
        std::sort(shares.begin(), shares.end());
        if (Index(shares.size()) > alternatives_) shares.resize(alternatives_);
        const Estimate none{free_cost_ / 2, count_};
        shares.insert(std::upper_bound(shares.begin(), shares.end(), none), none);
    }
    void add_estimate(Index row, Index column) {
        if (row < Index(rows_.size()) && column < Index(columns_.size())) estimates_.push({rows_[row].value + columns_[column].value, row, column});
    }
    void add_bound(Index a, Index b, Index c, Index d) {
        const double bound = bound_of(a, b, c, d);
        if (bound < INFINITY) bounds_.push({bound, c, d});
    }
    // Add the bounds of joining a and b to the two ends of another connection.
    void add_swaps(Index a, Index b) {
        for (const Estimate& row : rows_) {
            if (row.end < count_ && partner_[row.end] >= 0) add_bound(a, b, row.end, partner_[row.end]);
        }
    }

    double bound_of(Index a, Index b, Index c, Index d) const {
        if ((c == d && c < count_) || c == a || c == b || d == a || d == b) return INFINITY;
        const double first = c < count_ ? cost(a, c) + release_[c] : free_cost_ / 2;
        const double second = d < count_ ? cost(b, d) + release_[d] : free_cost_ / 2;
        const double rise = first + second - cost(a, b);
        if (c == count_ || d == count_ || partner_[c] < 0 || partner_[d] < 0) return rise;
        const Index e = partner_[c], f = partner_[d];
        if (d == e) return cost(a, c) + cost(b, d) - cost(c, d) - cost(a, b);
        const double apart = release_[c] + cost(c, e) + release_[d] + cost(d, f);
        return rise + least(cost(e, f) - apart, 0.0);
    }

    // Return the exchange in which a is joined to c and b to d, -1 being none, and their former partners elsewhere.
    Exchange exchange_for(Index a, Index b, Index c, Index d) const {
        Exchange exchange{};
        exchange.break_up(a, b);
        double before = cost(a, b);
        const Index low = std::min(c, d), high = std::max(c, d);
        if (c >= 0) exchange.join(a, c);
        if (d >= 0) exchange.join(b, d);
        std::array<Index, 2> left{};
        int left_count = 0;
        for (const Index end : {low, high}) {
            if (end < 0 || partner_[end] < 0 || (end == high && partner_[end] == low)) continue;
            const Index other = partner_[end];
            before += cost(end, other);
            exchange.break_up(end, other);
            if (other != high) left[left_count++] = other;
        }
        if (left_count == 2 && cost(left[0], left[1]) < free_cost_) {
            exchange.join(left[0], left[1]);
        } else {
            for (int k = 0; k < left_count; ++k) {
                const Index end = free_partner_[left[k]];
                if (end >= 0 && !exchange.joins_to(end)) exchange.join(left[k], end);
            }
        }
        double after = 0.0;
        for (int m = 0; m < exchange.made_count; ++m) after += cost(exchange.made[m][0], exchange.made[m][1]);
        exchange.rise = after - before + double(exchange.broken_count - 2 * exchange.made_count) * free_cost_ / 2;
        return exchange;
    }

    // Tell whether an exchange closes a ring of chains; ends e and e ^ 1 are those of one chain.
    bool closes_ring(const Exchange& exchange) const {
        count_visits(count_);
        std::vector<Index> now(count_);
        for (Index e = 0; e < count_; ++e) now[e] = partner_[e];
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

    Index count_;
    double free_cost_;
    Index alternatives_;
    std::vector<double> total_;  // (E, E), symmetric
    std::vector<Index> partner_, free_partner_;
    std::vector<double> release_;
    std::vector<double> cheapest_;  // of each end, the least cost of joining it to any other
    double tolerance_ = 0.0;        // more than the estimates are off by rounding
    std::vector<Estimate> rows_, columns_;
    std::priority_queue<Option> bounds_, estimates_;
};

auto second_best_rise(Matrix<double> cost, Matrix<Index> joined, Vector<double> joined_costs, double free_cost, bool allow_closed,
                      Index alternatives) {
    require(alternatives >= 0, "alternatives are negative");
    ReleasedGil released;
    Matching matching(cost, joined, joined_costs, free_cost, alternatives);
    std::vector<double> rises(joined.shape(0));
    for (std::size_t k = 0; k < rises.size(); ++k) rises[k] = matching.rise_without(joined(k, 0), joined(k, 1), allow_closed);
    released.end();
    return to_numpy(std::move(rises));
}

}  // namespace

void bind_second_best(Module& m) {
    // Return, for each connection of a matching of chain ends, by how much the total cost rises at least if it is not made.
    //
    // The total cost is the sum of the costs of all connections, and `free_cost` / 2 for each end that stays free. Without the
    // connection of ends a and b, each of the two stays free or is connected to another end; the former partners of those other
    // ends stay free, are connected to a free end, or to each other.
    //
    // Parameters
    // ----------
    // cost
    //     (E, E) float64, cost of connecting any two of E ends; the lower of [i, j] and [j, i] counts, infinite where that is not
    //     allowed. Costs above `free_cost` are not allowed. Ends 2 c and 2 c + 1 belong to chain c
    // joined, joined_costs
    //     (K, 2) int64 and (K,) float64, the two ends of each of K connections, and what it costs
    // free_cost
    //     cost of leaving two ends free
    // allow_closed
    //     True if an exchange of connections may close a chain to a ring
    // alternatives
    //     number of other ends at most that each of the two ends is tried with, those with the least estimate of the cost; all E of
    //     them give the least rise
    //
    // Returns
    // -------
    // (K,) float64, at most `free_cost` less the cost of the connection; negative if the matching was not the best one.
    //
    // Notes
    // -----
    // A lower bound of the rise is computed for each pair of ends to which a and b may be connected; the exchanges are tried in
    // order of their bounds until the bound exceeds the best rise so far.
    m.def("second_best_rise", &second_best_rise, "cost"_a.noconvert(), "joined"_a.noconvert(), "joined_costs"_a.noconvert(),
          "free_cost"_a, "allow_closed"_a, "alternatives"_a);
}
