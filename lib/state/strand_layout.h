// Where each strand lies in the batches (kernels/strand/strand_batch.h).
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/strand/strand_batch.h"

namespace ringlet::state {

struct Slot {
  std::int32_t batch, lane;
};

// Strands sorted by particle count (stable, so equal counts keep the file's order), kLanes to a batch.
class StrandLayout {
 public:
  explicit StrandLayout(std::span<const std::int32_t> counts);

  std::int32_t batches() const { return static_cast<std::int32_t>(row_.size()) - 1; }
  std::int64_t rows() const { return row_.back(); }
  std::int32_t longest() const { return longest_; }
  std::size_t strands() const { return slot_.size(); }
  const std::vector<std::int32_t>& row() const { return row_; }
  Slot slot(std::size_t strand) const { return slot_[strand]; }
  std::int32_t count(std::size_t strand) const { return counts_[strand]; }
  // The strand in a lane, -1 where there is none.
  std::int64_t strand_at(std::int32_t batch, std::int32_t lane) const {
    return strand_[batch * kernels::kLanes + lane];
  }

  // Index of a value of `components` a particle, in an array with a row per particle.
  std::size_t at(std::size_t strand, int particle, int components, int component) const {
    const Slot s = slot_[strand];
    return (static_cast<std::size_t>(row_[s.batch] + particle) * components + component) * kernels::kLanes +
           s.lane;
  }
  // Index of a value of `components` a strand.
  std::size_t at_strand(std::size_t strand, int components, int component) const {
    const Slot s = slot_[strand];
    return (static_cast<std::size_t>(s.batch) * components + component) * kernels::kLanes + s.lane;
  }

 private:
  std::vector<std::int32_t> counts_;
  std::vector<std::int32_t> row_;
  std::vector<Slot> slot_;
  std::vector<std::int64_t> strand_;
  std::int32_t longest_ = 0;
};

}  // namespace ringlet::state
