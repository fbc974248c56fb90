#include "branch_graph.h"

#include "polyline.h"

namespace {

std::pair<Index, Index> nodes_of(const Branch& branch) { return std::minmax(branch.a, branch.b); }

}  // namespace

double HalfWidths::at(const double* position) const {
    const double column = std::nearbyint(position[0] - u), row = std::nearbyint(position[1] - v);
    const Index x = Index(std::clamp(column, 0.0, double(width - 1))), y = Index(std::clamp(row, 0.0, double(height - 1)));
    return pixels[y * width + x];
}

BranchGraph::BranchGraph(const TracedBranches& traced, const double* points, Index dim) : dim_(dim) {
    std::vector<Index> sizes;
    count_visits(Index(traced.junction.size()));
    for (std::size_t k = 0; k < traced.junction.size(); ++k) {
        const Index node = traced.junction[k];
        for (Index d = 0; d < dim; ++d) require(std::isfinite(points[k * dim + d]), "a coordinate is not finite");
        if (node < 0) continue;
        if (node >= Index(sizes.size())) {
            sizes.resize(node + 1);
            nodes_.resize((node + 1) * dim);
        }
        ++sizes[node];
        for (Index d = 0; d < dim; ++d) nodes_[node * dim + d] += points[k * dim + d];
    }
    for (std::size_t i = 0; i < nodes_.size(); ++i) nodes_[i] /= double(sizes[i / dim]);
    at_.resize(sizes.size());
    is_node_.assign(sizes.size(), true);
    for (std::size_t b = 0; b + 1 < traced.bounds.size(); ++b) {
        std::vector<double> line;
        for (Index k = traced.bounds[b]; k < traced.bounds[b + 1]; ++k) {
            line.insert(line.end(), points + traced.order[k] * dim, points + (traced.order[k] + 1) * dim);
        }
        if (traced.nodes[2 * b] == LOOP) {
            loops.push_back(std::move(line));
        } else {
            add(traced.nodes[2 * b], traced.nodes[2 * b + 1], std::move(line));
        }
    }
}

std::vector<double> BranchGraph::all_points(const Branch& branch) const {
    std::vector<double> points;
    points.reserve(branch.points.size() + 2 * dim_);
    if (branch.a != FREE) points.insert(points.end(), nodes_.begin() + branch.a * dim_, nodes_.begin() + (branch.a + 1) * dim_);
    points.insert(points.end(), branch.points.begin(), branch.points.end());
    if (branch.b != FREE) points.insert(points.end(), nodes_.begin() + branch.b * dim_, nodes_.begin() + (branch.b + 1) * dim_);
    return points;
}

void BranchGraph::add(Index a, Index b, std::vector<double>&& points) {
    branches.push_back({a, b, std::move(points), 0.0});
    branches.back().length = arc_lengths(all_points(branches.back()), dim_).back();
    for (const Index node : {a, b}) {
        if (node != FREE) at_[node].insert(Index(branches.size()) - 1);
    }
}

void BranchGraph::remove(Index number) {
    branches[number].is_there = false;
    for (const Index node : {branches[number].a, branches[number].b}) {
        if (node != FREE) at_[node].erase(number);
    }
}

// Remove a branch and unite the two nodes at its ends to one, half way between them, under the number of the first.
void BranchGraph::contract(Index bridge) {
    const Index kept = branches[bridge].a, gone = branches[bridge].b;
    remove(bridge);
    for (Index d = 0; d < dim_; ++d) nodes_[kept * dim_ + d] = (nodes_[kept * dim_ + d] + nodes_[gone * dim_ + d]) / 2;
    is_node_[gone] = false;
    for (const Index number : std::vector<Index>(at_[gone].begin(), at_[gone].end())) {
        remove(number);
        const Index a = branches[number].a, b = branches[number].b;
        add(a == gone ? kept : a, b == gone ? kept : b, std::move(branches[number].points));
    }
}

// Return the points of a branch from a node to its other end, and that end.
std::vector<double> BranchGraph::from_end(Index number, Index node, Index& far) const {
    const Branch& branch = branches[number];
    far = branch.a == node ? branch.b : branch.a;
    return branch.a == node ? branch.points : reversed(branch.points, dim_);
}

// Remove a node with fewer than three branches: two become one through its position, a single one gets a free end there. A node whose
// only branch is a loop from the node to itself stays.
void BranchGraph::dissolve(Index node) {
    if (!is_node_[node] || at_[node].size() > 2) return;
    const std::vector<Index> ending(at_[node].begin(), at_[node].end());
    for (const Index number : ending) {
        if (branches[number].a == branches[number].b) return;
    }
    is_node_[node] = false;
    for (const Index number : ending) remove(number);
    if (ending.empty()) return;
    const double* position = nodes_.data() + node * dim_;
    Index first = FREE, last = FREE;
    std::vector<double> points;
    if (ending.size() == 2) points = reversed(from_end(ending[0], node, first), dim_);
    points.insert(points.end(), position, position + dim_);
    const std::vector<double> after = from_end(ending.back(), node, last);
    points.insert(points.end(), after.begin(), after.end());
    add(first, last, std::move(points));
}

// Put the branches that were added in the queues, once each; whether one may still go is asked when it comes up.
void BranchGraph::take(const Least& least, const HalfWidths& widths) {
    for (; seen_ < Index(branches.size()); ++seen_) {
        const Branch& branch = branches[seen_];
        const Entry entry{branch.length, seen_};
        if (!branch.is_there) continue;
        if (branch.is_spur()) {
            const Index node = branch.a == FREE ? branch.b : branch.a;
            const double corner = widths.width > 0 ? least.corner_widths * widths.at(nodes_.data() + node * dim_) : 0.0;
            if (branch.length < std::max(least.spur, corner)) removable_.push(entry);
        } else if (branch.a == branch.b) {
            if (branch.a != FREE && branch.length < least.loop) removable_.push(entry);
        } else {
            if (branch.length < least.loop) {
                // the branches that were too long to be around a small hole with the shortest so far may now be short enough
                const Index former = shortest_between(branch);
                std::set<Entry>& beside = between_[nodes_of(branch)];
                if (former >= 0 && entry < Entry{branches[former].length, former}) {
                    for (const Entry& other : beside) removable_.push(other);
                }
                beside.insert(entry);
                removable_.push(entry);
            }
            if (branch.length < least.bridge) bridges_.push(entry);
        }
    }
}

// The shortest branch between the nodes of a branch; -1 without any shorter than a small loop.
Index BranchGraph::shortest_between(const Branch& branch) {
    std::set<Entry>& beside = between_[nodes_of(branch)];
    while (!beside.empty() && !branches[beside.begin()->second].is_there) beside.erase(beside.begin());
    return beside.empty() ? -1 : beside.begin()->second;
}

bool BranchGraph::may_go(Index number, double min_loop) {
    const Branch& branch = branches[number];
    if (branch.is_spur()) return true;
    if (branch.a == branch.b) return !is_loop(branch);
    const Index shortest = shortest_between(branch);
    return shortest >= 0 && shortest != number && branches[shortest].length + branch.length < min_loop;
}

// The shortest of: spurs, small loops, and the longer of two branches around a small hole; -1 without any.
Index BranchGraph::pop_removable(double min_loop) {
    while (!removable_.empty()) {
        const Index number = removable_.top().second;
        removable_.pop();
        if (branches[number].is_there && may_go(number, min_loop)) return number;
    }
    return -1;
}

// The shortest branch between the two forks of a crossing; -1 without any.
Index BranchGraph::pop_bridge() {
    while (!bridges_.empty()) {
        const Index number = bridges_.top().second;
        bridges_.pop();
        if (branches[number].is_there) return number;
    }
    return -1;
}

void BranchGraph::simplify(const Least& least, const HalfWidths& widths) {
    for (Index node = 0; node < Index(at_.size()); ++node) dissolve(node);
    for (;;) {
        take(least, widths);
        const Index shortest = pop_removable(least.loop);
        if (shortest < 0) {
            const Index bridge = pop_bridge();
            if (bridge < 0) return;
            contract(bridge);
            continue;
        }
        // either node may be first, which decides the direction of the branch that is left; recorded results have this order
        Index first = branches[shortest].a, last = branches[shortest].b;
        if (last % 8 < first % 8) std::swap(first, last);
        (first == FREE || last == FREE ? spur_length : loop_length) += branches[shortest].length;
        remove(shortest);
        for (const Index node : {first, last}) {
            if (node != FREE) dissolve(node);
        }
    }
}
