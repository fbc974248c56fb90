// Maximum-weight matching by Edmonds' blossoms.
#include "arrays.h"

#include <nanobind/stl/optional.h>

#include <algorithm>
#include <deque>

namespace {

void check(const Matrix<double>& weight) { require(weight.shape(0) == weight.shape(1), "weight is not square"); }

// Maximum-weight matching by Edmonds' blossoms: the primal-dual method of Galil (ACM Computing Surveys 18, 1986), with a table of
// the tightest edges between blossoms, and one search for each exposed vertex.
//
// Vertices are 1 to n, blossoms n + 1 and up, 0 is none. label(u) + label(v) - 2 w(u, v), plus the labels of the blossoms that hold
// both, is the excess of an edge: never negative, and 0 (tight) for edges of the matching. All are integers, so an edge is tight
// exactly or not at all; the ends of a tight edge are both odd numbers or both even, so half the excess between two
// vertices of a search is an integer too. A matching is the heaviest where every exposed vertex has the label 0.
//
// A search starts at an exposed vertex with a label above 0 and ends when it has matched it, or when a vertex of the label 0 is found
// that may be exposed in its place. A vertex or blossom in it is EVEN or ODD by its distance from the start.
//
// After some weights are lowered the labels are still feasible, so only the vertices of pairs that are no longer tight are
// searched from again.
class Blossoms {
public:
    // weight of the edge between vertices a and b of 0 to n - 1; 0 for none
    template <class Weight>
    Blossoms(Index n, const Weight& weight) : n_(n), used_(n), size_(n + n / 2 + 2), edges_(size_ * size_), flower_from_(size_ * (n + 1)) {
        count_visits(size_ * size_);
        label_.assign(size_, 0);
        match_ = slack_ = outer_ = parent_ = label_;
        visited_.assign(size_, 0);
        side_.assign(size_, UNSEEN);
        flower_.resize(size_);
        neighbors_.resize(n + 1);
        for (Index u = 1; u <= n; ++u) {
            outer_[u] = u;
            flower_from(u, u) = std::int32_t(u);
            for (Index v = 1; v <= n; ++v) {
                edge(u, v) = {std::int32_t(u), std::int32_t(v), u == v ? 0 : weight(u - 1, v - 1)};
                if (edge(u, v).weight > 0) neighbors_[u].push_back(v);
                label_[u] = std::max(label_[u], edge(u, v).weight);
            }
        }
    }

    // Lower the weight of the edge between two vertices of 0 to n - 1; `solve` makes the matching the heaviest again.
    void lower(Index a, Index b, std::int64_t weight) {
        const Index u = a + 1, v = b + 1;
        // the table knows the tightest edge to each blossom, which this may be
        if (outer_[u] > n_) dissolve(outer_[u]);
        if (outer_[v] > n_) dissolve(outer_[v]);
        edge(u, v).weight = edge(v, u).weight = std::min(weight, edge(u, v).weight);
        if (match_[u] == v) match_[u] = match_[v] = 0;
    }

    void solve() {
        for (Index u = 1; u <= n_; ++u) {
            while (!match_[u] && label_[u] > 0) search(outer_[u]);
        }
    }

    // the partner of a vertex of 0 to n - 1; -1 for none
    Index partner(Index vertex) const { return match_[vertex + 1] - 1; }

private:
    enum Side : std::int8_t { UNSEEN = -1, EVEN = 0, ODD = 1 };
    struct Edge {
        std::int32_t from, to;
        std::int64_t weight;
    };

    Edge& edge(Index u, Index v) { return edges_[u * size_ + v]; }
    std::int32_t& flower_from(Index b, Index x) { return flower_from_[b * (n_ + 1) + x]; }
    std::int64_t excess(const Edge& e) { return label_[e.from] + label_[e.to] - 2 * edge(e.from, e.to).weight; }

    void update_slack(Index u, Index x) {
        if (!slack_[x] || excess(edge(u, x)) < excess(edge(slack_[x], x))) slack_[x] = u;
    }
    void set_slack(Index x) {
        slack_[x] = 0;
        count_visits(n_);
        for (Index u = 1; u <= n_; ++u) {
            if (edge(u, x).weight > 0 && outer_[u] != x && side_[outer_[u]] == EVEN) update_slack(u, x);
        }
    }
    void push(Index x) {
        if (x <= n_) {
            queue_.push_back(x);
        } else {
            for (const Index part : flower_[x]) push(part);
        }
    }
    void set_outer(Index x, Index b) {
        outer_[x] = b;
        if (x > n_) {
            for (const Index part : flower_[x]) set_outer(part, b);
        }
    }
    // the even position of a part in its blossom, which is turned round where the position is odd
    Index position(Index b, Index part) {
        std::vector<Index>& parts = flower_[b];
        const Index at = std::find(parts.begin(), parts.end(), part) - parts.begin();
        if (at % 2 == 0) return at;
        std::reverse(parts.begin() + 1, parts.end());
        return Index(parts.size()) - at;
    }
    void set_match(Index u, Index v) {
        match_[u] = edge(u, v).to;
        if (u <= n_) return;
        const Index part = flower_from(u, edge(u, v).from), at = position(u, part);
        for (Index i = 0; i < at; ++i) set_match(flower_[u][i], flower_[u][i ^ 1]);
        set_match(part, v);
        std::rotate(flower_[u].begin(), flower_[u].begin() + at, flower_[u].end());
    }
    void augment(Index u, Index v) {
        for (;;) {
            const Index before = outer_[match_[u]];
            set_match(u, v);
            if (!before) return;
            set_match(before, outer_[parent_[before]]);
            u = outer_[parent_[before]];
            v = before;
        }
    }
    Index common_ancestor(Index u, Index v) {
        for (++ancestors_; u || v; std::swap(u, v)) {
            if (!u) continue;
            if (visited_[u] == ancestors_) return u;
            visited_[u] = ancestors_;
            u = outer_[match_[u]];
            if (u) u = outer_[parent_[u]];
        }
        return 0;
    }
    void add_blossom(Index u, Index ancestor, Index v) {
        Index b = n_ + 1;
        while (b <= used_ && outer_[b]) ++b;
        if (b > used_) ++used_;
        label_[b] = 0;
        side_[b] = EVEN;
        match_[b] = match_[ancestor];
        flower_[b].assign(1, ancestor);
        const auto climb = [&](Index x) {
            while (x != ancestor) {
                const Index y = outer_[match_[x]];
                flower_[b].push_back(x);
                flower_[b].push_back(y);
                push(y);
                x = outer_[parent_[y]];
            }
        };
        climb(u);
        std::reverse(flower_[b].begin() + 1, flower_[b].end());
        climb(v);
        set_outer(b, b);
        count_visits(used_ * Index(flower_[b].size()));
        for (Index x = 1; x <= used_; ++x) edge(b, x).weight = edge(x, b).weight = 0;
        for (Index x = 1; x <= n_; ++x) flower_from(b, x) = 0;
        for (const Index part : flower_[b]) {
            for (Index x = 1; x <= used_; ++x) {
                if (edge(part, x).weight > 0 && (edge(b, x).weight == 0 || excess(edge(part, x)) < excess(edge(b, x)))) {
                    edge(b, x) = edge(part, x);
                    edge(x, b) = edge(x, part);
                }
            }
            for (Index x = 1; x <= n_; ++x) {
                if (flower_from(part, x)) flower_from(b, x) = std::int32_t(part);
            }
        }
        set_slack(b);
    }
    void expand_blossom(Index b) {
        for (const Index part : flower_[b]) set_outer(part, part);
        const Index entered = flower_from(b, edge(b, parent_[b]).from), at = position(b, entered);
        for (Index i = 0; i < at; i += 2) {
            const Index odd = flower_[b][i], even = flower_[b][i + 1];
            parent_[odd] = edge(even, odd).from;
            side_[odd] = ODD;
            side_[even] = EVEN;
            slack_[odd] = 0;
            set_slack(even);
            push(even);
        }
        side_[entered] = ODD;
        parent_[entered] = parent_[b];
        for (Index i = at + 1; i < Index(flower_[b].size()); ++i) {
            side_[flower_[b][i]] = UNSEEN;
            set_slack(flower_[b][i]);
        }
        outer_[b] = 0;
    }
    // Undo a blossom and those in it. Their labels go to the vertices, which keeps every excess or raises it.
    void dissolve(Index b) {
        std::vector<Index> vertices;
        undo(b, vertices);
        for (const Index u : vertices) {
            const Index v = match_[u];
            if (v && excess(edge(u, v)) != 0) {
                // the partner may lie in another blossom, which is exposed from now on
                for (const Index x : {outer_[u], outer_[v]}) match_[x] = 0;
                expose(outer_[v], v);
                match_[u] = match_[v] = 0;
            }
        }
    }
    void undo(Index b, std::vector<Index>& vertices) {
        const std::size_t first = vertices.size();
        for (const Index part : flower_[b]) {
            if (part <= n_) {
                outer_[part] = part;
                vertices.push_back(part);
            } else {
                undo(part, vertices);
            }
        }
        for (std::size_t k = first; k < vertices.size(); ++k) label_[vertices[k]] += label_[b] / 2;
        outer_[b] = 0;
        match_[b] = 0;
        flower_[b].clear();
    }
    // Make a vertex the one of a vertex or blossom that no pair inside it holds.
    void expose(Index x, Index vertex) {
        match_[x] = 0;
        if (x <= n_) return;
        const Index part = flower_from(x, vertex), at = position(x, part);
        for (Index i = 0; i < at; ++i) set_match(flower_[x][i], flower_[x][i ^ 1]);
        expose(part, vertex);
        std::rotate(flower_[x].begin(), flower_[x].begin() + at, flower_[x].end());
    }
    // Expose a vertex of an EVEN vertex or blossom instead of the start of the search.
    void exchange(Index vertex) {
        const Index x = outer_[vertex], before = outer_[match_[x]];
        expose(x, vertex);
        if (!before) return;
        set_match(before, outer_[parent_[before]]);
        augment(outer_[parent_[before]], before);
    }
    // Use a tight edge; tell whether the matching grew.
    bool use(const Edge e) {
        const Index u = outer_[e.from], v = outer_[e.to];
        if (side_[v] == UNSEEN) {
            if (!match_[v]) {
                augment(u, v);
                augment(v, u);
                return true;
            }
            parent_[v] = e.from;
            side_[v] = ODD;
            const Index next = outer_[match_[v]];
            slack_[v] = slack_[next] = 0;
            side_[next] = EVEN;
            push(next);
        } else if (side_[v] == EVEN) {
            add_blossom(u, common_ancestor(u, v), v);
        }
        return false;
    }
    // Search from an exposed vertex or blossom until it is matched, or a vertex of the label 0 is exposed instead.
    void search(Index start) {
        std::fill(side_.begin(), side_.end(), UNSEEN);
        std::fill(slack_.begin(), slack_.end(), 0);
        queue_.clear();
        parent_[start] = 0;
        side_[start] = EVEN;
        push(start);
        for (;;) {
            while (!queue_.empty()) {
                const Index u = queue_.front();
                queue_.pop_front();
                if (side_[outer_[u]] == ODD) continue;
                count_visits(Index(neighbors_[u].size()));
                for (const Index v : neighbors_[u]) {
                    if (edge(u, v).weight > 0 && outer_[u] != outer_[v]) {
                        if (excess(edge(u, v)) == 0) {
                            if (use(edge(u, v))) return;
                        } else {
                            update_slack(u, outer_[v]);
                        }
                    }
                }
            }
            if (const Index vertex = adjust_labels()) return exchange(vertex);
            for (Index x = 1; x <= used_; ++x) {
                if (outer_[x] == x && slack_[x] && outer_[slack_[x]] != x && side_[x] != ODD && excess(edge(slack_[x], x)) == 0) {
                    if (use(edge(slack_[x], x))) return;
                }
            }
            for (Index b = n_ + 1; b <= used_; ++b) {
                if (outer_[b] == b && side_[b] == ODD && label_[b] == 0) expand_blossom(b);
            }
        }
    }
    // Change the labels until another edge is tight, a blossom may be expanded, or an EVEN vertex has the label 0, which is returned.
    Index adjust_labels() {
        std::int64_t change = INT64_MAX;
        count_visits(used_);
        Index lowest = 0;
        for (Index u = 1; u <= n_; ++u) {
            if (side_[outer_[u]] == EVEN && label_[u] < change) {
                change = label_[u];
                lowest = u;
            }
        }
        for (Index b = n_ + 1; b <= used_; ++b) {
            if (outer_[b] == b && side_[b] == ODD && label_[b] / 2 < change) {
                change = label_[b] / 2;
                lowest = 0;
            }
        }
        for (Index x = 1; x <= used_; ++x) {
            if (outer_[x] != x || !slack_[x] || side_[x] == ODD) continue;
            const std::int64_t over = excess(edge(slack_[x], x)) / (side_[x] == EVEN ? 2 : 1);
            if (over < change) {
                change = over;
                lowest = 0;
            }
        }
        for (Index u = 1; u <= n_; ++u) {
            const Side side = side_[outer_[u]];
            if (side == EVEN) label_[u] -= change;
            if (side == ODD) label_[u] += change;
        }
        for (Index b = n_ + 1; b <= used_; ++b) {
            if (outer_[b] != b) continue;
            if (side_[b] == EVEN) label_[b] += 2 * change;
            if (side_[b] == ODD) label_[b] -= 2 * change;
        }
        return lowest;
    }

    const Index n_;
    Index used_;
    const Index size_;
    std::vector<Edge> edges_;
    std::vector<std::int32_t> flower_from_;  // (b, x) -> the part of blossom b that holds vertex x; 0 for none
    std::vector<std::int64_t> label_, match_, slack_, outer_, parent_;
    std::vector<Index> visited_;
    std::vector<Side> side_;
    std::vector<std::vector<Index>> flower_, neighbors_;
    std::deque<Index> queue_;
    Index ancestors_ = 0;
};

// The weights as integers.
class IntegerWeights {
public:
    explicit IntegerWeights(const Matrix<double>& weight) : weight_(weight) {
        check(weight);
        const Index size = Index(weight.shape(0));
        require(size <= MAX_BLOSSOM_MEMBERS, "there are more than 5000 members: the table of their pairs does not fit the memory");
        double heaviest = 0.0;
        for (Index k = 0; k < size * size; ++k) {
            require(std::isfinite(weight.data()[k]), "a weight is not finite");
            heaviest = std::max(heaviest, weight.data()[k]);
        }
        if (heaviest > 0) scale_ = std::ldexp(1.0, 50) / heaviest;  // sums of some weights stay below 2^63
    }
    std::int64_t rounded(double weight) const { return std::int64_t(std::llround(std::max(weight, 0.0) * scale_)); }
    std::int64_t operator()(Index a, Index b) const { return rounded(weight_(std::min(a, b), std::max(a, b))); }

private:
    // the table of pairs takes about 40 bytes for each
    static constexpr Index MAX_BLOSSOM_MEMBERS = 5000;

    const Matrix<double>& weight_;
    double scale_ = 1.0;
};

auto partners(const Blossoms& blossoms, Index count) {
    std::vector<Index> partner(count);
    for (Index k = 0; k < count; ++k) partner[k] = blossoms.partner(k);
    return to_numpy(std::move(partner));
}

using Pairs = std::pair<Matrix<Index>, Vector<double>>;
using Lowered = nb::typed<nb::callable, Pairs(VectorResult<Index>)>;

auto match_by_blossoms(Matrix<double> weight, std::optional<Lowered> lowered) {
    const Index count = weight.shape(0);
    ReleasedGil released;
    const IntegerWeights integers(weight);
    Blossoms blossoms(count, integers);
    released.end();
    for (;;) {
        {
            nb::gil_scoped_release solving;
            blossoms.solve();
        }
        if (!lowered) return partners(blossoms, count);
        const auto [pairs, weights] = nb::cast<Pairs>((*lowered)(partners(blossoms, count)));
        require(pairs.shape(1) == 2 && pairs.shape(0) == weights.shape(0), "the lowered weights are not one per pair");
        if (pairs.shape(0) == 0) return partners(blossoms, count);
        for (std::size_t k = 0; k < pairs.shape(0); ++k) {
            const Index a = pairs(k, 0), b = pairs(k, 1);
            require(a >= 0 && a < count && b >= 0 && b < count && a != b, "a lowered pair is not two of the members");
            require(!std::isnan(weights(k)), "a lowered weight is not a number");
            blossoms.lower(a, b, integers.rounded(weights(k)));
        }
    }
}

}  // namespace

void bind_matching(Module& m) {
    // Pair E chain ends so that the total weight of the pairs is largest (maximum-weight matching), each end in one pair at most.
    //
    // It is found by Edmonds' blossom algorithm, on the weights rounded to 2^-50 of the largest. Where weights are lowered, only the
    // part of the matching that this changes is searched anew.
    //
    // Parameters
    // ----------
    // weight
    //     (E, E) float64, symmetric, the weight of pairing two ends; 0 for two ends that may not be paired
    // lowered
    //     is called with the matching (E,), and returns pairs (K, 2) int64 of ends and their new weights (K,) float64; weights
    //     larger than before are ignored. The ends are then matched again, until it returns no pairs. None accepts the first
    //     matching
    //
    // Returns
    // -------
    // (E,) int64, the end that each is paired with; -1 for none.
    //
    // Raises
    // ------
    // ValueError : there are more than 5000 ends.
    m.def("match_by_blossoms", &match_by_blossoms, "weight"_a.noconvert(), "lowered"_a = nb::none());
}
