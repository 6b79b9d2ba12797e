// The run that all others are measured against.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "study/runner.h"

namespace ringlet::study {

// One run of the reference's doubling.
struct Level {
  int substeps = 0;
  bool diverged = false;
  std::optional<Spread> change;  // of positions from the level before [scene units]; nothing: it is the first
  std::optional<double> order;   // by which the change fell from that of the level before
  std::optional<double> median_strand, median_strand_order;  // the same of the median strand
};

// The substeps that the reference is to reach from the start, in doublings: sixteen times those of the finest
// run, whose error is then more than ten times the last change where the method is of first order. Under a
// cap that is too low for this, as many doublings that end under it.
std::vector<int> ladder(int most_substeps, int cap);

// The scene as given in double precision on the CPU, substeps doubled. Each level is a cache in `directory`,
// of which the last complete one stays.
class Reference {
 public:
  struct Plan {
    std::filesystem::path file;
    std::vector<std::string> overrides;  // of the scene as given, and what the reference shall differ in
    Machine machine;                     // threads and instruction set
    std::filesystem::path directory;
    int most_substeps;  // of the runs
    int cap;
  };
  // `levels`: those that an earlier study has left in the directory.
  Reference(Plan plan, std::vector<Level> levels);

  bool started() const;     // there are as many levels as the ladder asks for, or no more are of use
  bool can_refine() const;  // the cap allows one more
  int next() const;         // its substeps; 0: none within the cap
  Ending refine(const Common& common);  // one level more

  const std::vector<Level>& levels() const { return levels_; }
  int substeps() const;                              // of the last complete level; 0: there is none
  std::optional<Spread> change() const;              // its change
  double resolution() const { return resolution_; }  // of positions in frames [scene units]
  bool resolved() const;                             // the change is as small as single precision shows
  scene::Scene scene(int substeps) const;
  std::vector<std::string> overrides(int substeps) const;
  std::filesystem::path cache() const;  // of the last complete level
  const Plan& plan() const { return plan_; }

 private:
  void compare(Level& level, int before);
  std::filesystem::path directory_of(int substeps) const;

  Plan plan_;
  std::vector<int> ladder_;
  std::vector<Level> levels_;
  double resolution_ = 0;
};

}  // namespace ringlet::study
