// The head as the wind sees it: kernels/wind/shelter.h.
#pragma once
#include <limits>
#include <span>
#include <vector>

#include "core/geometry.h"
#include "kernels/wind/shelter.h"

namespace ringlet::effects {

class ShelterMap {
 public:
  // Draws the mesh as seen along `wind` (not zero) into a grid of square cells, kCells and one along its
  // longer side.
  void draw(std::span<const Vec3> vertices, std::span<const Triangle> triangles, const Vec3& wind);

  void reserve();  // all that `draw` will ever hold

  kernels::ShelterMap view() const;  // valid until the next `draw`
  std::size_t bytes() const { return (front_.capacity() + rear_.capacity()) * sizeof(float); }

 private:
  static constexpr int kCells = 192;
  void draw_triangle(const Vec3& a, const Vec3& b, const Vec3& c);
  void mark(int column, int row, double depth);

  Mat3 axes_;    // rows: right, up, wind
  Vec3 origin_;  // of the cells, in the axes [m]
  double cell_ = 1;
  int columns_ = 0, rows_ = 0;
  std::vector<float> front_, rear_;
};

}  // namespace ringlet::effects
