// What the runs of a study say: which are worth their time, what accuracy costs, how fast errors fall.
#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace ringlet::study {

// A run as a point of the work-precision plot.
struct Point {
  double milliseconds;  // of a frame
  double error;
};

// An error is smaller than another where it is under this share of it: what differs less tells nothing.
inline constexpr double kGain = 0.99;

// Indices of the Pareto front, from the quickest to the most accurate: each is more accurate than all that
// are as quick or quicker. Points that are not finite are on no front.
std::vector<std::size_t> pareto_front(const std::vector<Point>& points);

// The point of the front that is both quicker and no less accurate than `point`, or as quick and more
// accurate, and of these the most accurate; nothing for points of the front.
std::optional<std::size_t> dominating(const std::vector<Point>& points, const std::vector<std::size_t>& front,
                                      std::size_t point);

// The front's knee: its point farthest below the straight line between its ends, with both axes logarithmic
// and scaled to the front's extent. Before it accuracy is cheap, behind it time buys little. Nothing where no
// point lies below that line.
std::optional<std::size_t> knee(const std::vector<Point>& points, const std::vector<std::size_t>& front);

// How many times as long a tenth of the error takes, along the front: the slope of the least squares line
// through its points with an error above 0 in logarithmic axes. Nothing of fewer than two such errors, nor
// where all lie within a twentieth of a digit, which says nothing about a whole one.
std::optional<double> digit_cost(const std::vector<Point>& points, const std::vector<std::size_t>& front);

// The same between two points.
std::optional<double> digit_cost(const Point& from, const Point& to);

// Orders of convergence: of errors that fall as value^-order, from each value to the next; not a number where
// an error is 0 or values are the same. `values` ascend.
std::vector<double> orders(const std::vector<double>& values, const std::vector<double>& errors);

struct Wanted {
  std::optional<double> budget;  // [ms] a frame may take
  std::optional<double> target;  // the largest error
};

// With a target the quickest point that meets it (and the budget), else the most accurate within the budget.
std::optional<std::size_t> pick(const std::vector<Point>& points, const Wanted& wanted);

}  // namespace ringlet::study
