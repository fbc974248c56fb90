// The skeleton as a graph: branches between nodes, where a node is a junction of branches; and its simplification.
#pragma once

#include "thinning.h"

#include <map>
#include <queue>
#include <set>

// A line of the skeleton between two ends, each a node or FREE, a tip. A branch never changes: one that is cut, joined or moved is removed,
// and another one added.
struct Branch {
    Index a, b;
    std::vector<double> points;  // (P, D), from a to b, without the positions of the nodes
    double length;               // from node to node, when it was added
    bool is_there = true;

    bool is_spur() const { return (a == FREE) != (b == FREE); }
};

// What is kept of a skeleton, in the unit of its points.
struct Least {
    double spur;            // length; shorter spurs are removed
    double loop;            // perimeter; shorter loops are holes in the surface
    double bridge;          // length; shorter branches between two forks are contracted: strands at over 40 degrees thin to them
    double corner_widths;   // half-widths of a region; a spur that reaches no farther leads to its corner
};

// The distance from each pixel of an image to the object's edge, 0 outside of the object.
struct HalfWidths {
    const float* pixels;
    Index height, width;  // 0 where corners do not matter
    double u, v;          // position of the image's first pixel

    // positions outside of the image count as the nearest in it
    double at(const double* position) const;
};

class BranchGraph {
public:
    // One node in the middle of each cluster of junction voxels; `points` (K, D) of the voxels.
    BranchGraph(const TracedBranches& traced, const double* points, Index dim);

    // Remove spurs and small loops, the shortest first, and unite the two forks of a crossing.
    //
    // A spur is a branch with one free end. A node left with fewer than three branches is dissolved. Thinning turns a crossing of two
    // strands into two forks with a short branch between them; such branches are contracted last.
    void simplify(const Least& least, const HalfWidths& widths);

    // Tell whether a branch starts and ends at one node that has no other branch.
    bool is_loop(const Branch& branch) const { return branch.a == branch.b && branch.a != FREE && at_[branch.a].size() == 1; }

    // The points of a branch with the positions of its nodes added, in order from a to b; a tip has no node.
    std::vector<double> all_points(const Branch& branch) const;

    std::vector<Branch> branches;            // in the order in which they were added, those removed too
    std::vector<std::vector<double>> loops;  // closed, without any junction: points (P, D) in order, the first not repeated
    double spur_length = 0.0, loop_length = 0.0;

private:
    using Entry = std::pair<double, Index>;  // length and number of a branch: the shortest first, of equal ones the first added
    using Queue = std::priority_queue<Entry, std::vector<Entry>, std::greater<Entry>>;

    void add(Index a, Index b, std::vector<double>&& points);
    void remove(Index number);
    void contract(Index bridge);
    void dissolve(Index node);
    std::vector<double> from_end(Index number, Index node, Index& far) const;
    void take(const Least& least, const HalfWidths& widths);
    bool may_go(Index number, double min_loop);
    Index shortest_between(const Branch& branch);
    Index pop_removable(double min_loop);
    Index pop_bridge();

    Index dim_, seen_ = 0;
    std::vector<double> nodes_;            // positions (nodes, D)
    std::vector<std::set<Index>> at_;      // numbers of the branches that end at each node
    std::vector<bool> is_node_;            // False for one that was dissolved or united with another
    Queue removable_, bridges_;
    std::map<std::pair<Index, Index>, std::set<Entry>> between_;  // by nodes, of those shorter than a small loop
};
