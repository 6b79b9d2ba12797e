// Closing surfaces: boundary loops, caps, parts that are inside out, hollows.
#include "solids/surface.h"

#include <map>

#include "unit/solids_fixtures.h"

namespace ringlet::solids {
namespace {

ClosedSurface close(const Shape& shape) { return close_surface("shape", shape.vertices, shape.triangles); }

// Every edge is used once each way: closed and consistently wound.
bool is_closed(const std::vector<Triangle>& triangles) {
  std::map<std::pair<int, int>, int> balance;
  for (const Triangle& t : triangles)
    for (std::size_t c = 0; c < 3; ++c) {
      const int a = t[c], b = t[(c + 1) % 3];
      balance[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
    }
  return std::all_of(balance.begin(), balance.end(), [](const auto& edge) { return edge.second == 0; });
}

std::vector<Vec3> complete(const ClosedSurface& surface, std::vector<Vec3> vertices) {
  vertices.resize(surface.vertex_count());
  surface.follow(vertices);
  return vertices;
}

TEST(Surface, AClosedOneIsLeftAlone) {
  const Shape ball = sphere(1);
  const ClosedSurface surface = close(ball);
  EXPECT_TRUE(surface.loops.empty());
  EXPECT_EQ(surface.triangles, ball.triangles);
}

TEST(Surface, AnOpenCylinderGetsTwoCapsThatFollowIt) {
  const int segments = 40;
  Shape pipe = open_cylinder(2, 5, segments);
  const ClosedSurface surface = close(pipe);
  ASSERT_EQ(surface.loops.size(), 2u);
  EXPECT_EQ(surface.triangles.size(), pipe.triangles.size() + 2 * segments);
  EXPECT_TRUE(is_closed(surface.triangles));
  const std::vector<Vec3> closed = complete(surface, pipe.vertices);
  const double polygon = 0.5 * segments * 4 * std::sin(2 * std::numbers::pi / segments);
  EXPECT_NEAR(signed_volume(closed, surface.triangles), polygon * 5, 1e-12 * polygon * 5);
  EXPECT_LE((closed[pipe.vertices.size()] - Vec3(0, 0, 0)).norm() * (closed.back() - Vec3(0, 0, 5)).norm(),
            1e-12);

  for (Vec3& v : pipe.vertices) v = Vec3(v.x() + v.z(), 2 * v.y(), v.z());
  const std::vector<Vec3> sheared = complete(surface, pipe.vertices);
  EXPECT_NEAR(signed_volume(sheared, surface.triangles), 2 * polygon * 5, 1e-11 * polygon * 5);
}

TEST(Surface, AnInsideOutOneIsTurned) {
  const Shape ball = sphere(1);
  EXPECT_EQ(close(ball.turned_inside_out()).triangles, ball.triangles);
}

TEST(Surface, InsideOutPartsBesideOthersAreTurnedAndHollowsKept) {
  Shape all = sphere(2);
  const std::size_t outer = all.triangles.size();
  all.append(sphere(1).turned_inside_out());
  const std::size_t hollow = all.triangles.size();
  all.append(sphere(0.5, {5, 0, 0}).turned_inside_out());
  const ClosedSurface surface = close(all);
  ASSERT_EQ(surface.triangles.size(), all.triangles.size());
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    EXPECT_EQ(surface.bounds_cavity[t], t >= outer && t < hollow);
    EXPECT_EQ(surface.triangles[t] == all.triangles[t], t < hollow);
  }
}

TEST(Surface, HolesThatTouchAtAVertexAreTwoLoops) {
  Shape ball = sphere(1, Vec3::Zero(), 12, 24);
  // Triangles i and j share one vertex and no edge: without them there are two holes.
  const Triangle hole = ball.triangles[100];
  std::size_t other = 0;
  const auto shared = [&](const Triangle& t) {
    int count = 0;
    for (const int v : t) count += std::count(hole.begin(), hole.end(), v);
    return count;
  };
  while (shared(ball.triangles[other]) != 1) ++other;
  ball.triangles.erase(ball.triangles.begin() + 100);
  ball.triangles.erase(ball.triangles.begin() + static_cast<std::ptrdiff_t>(other < 100 ? other : other - 1));
  const ClosedSurface surface = close(ball);
  ASSERT_EQ(surface.loops.size(), 2u);
  EXPECT_TRUE(is_closed(surface.triangles));
}

TEST(Surface, AFinOnAClosedSurfaceIsClosedToo) {
  Shape ball = sphere(1, Vec3::Zero(), 12, 24);
  const Triangle base = ball.triangles[50];
  ball.vertices.emplace_back(3, 3, 3);
  ball.triangles.push_back({base[0], base[1], static_cast<int>(ball.vertices.size()) - 1});
  const ClosedSurface surface = close(ball);
  EXPECT_EQ(surface.loops.size(), 1u);
  std::map<std::pair<int, int>, int> uses;
  for (const Triangle& t : surface.triangles)
    for (std::size_t c = 0; c < 3; ++c)
      ++uses[{std::min(t[c], t[(c + 1) % 3]), std::max(t[c], t[(c + 1) % 3])}];
  for (const auto& [edge, count] : uses) EXPECT_EQ(count % 2, 0);
}

TEST(Surface, DegenerateTrianglesKeepTheirPlacesAndOpenNothing) {
  Shape ball = sphere(1, Vec3::Zero(), 12, 24);
  const Triangle t = ball.triangles[10];
  ball.triangles.insert(ball.triangles.begin() + 10, Triangle{t[0], t[1], t[1]});
  const ClosedSurface surface = close(ball);
  EXPECT_TRUE(surface.loops.empty());
  EXPECT_EQ(surface.triangles, ball.triangles);
}

}  // namespace
}  // namespace ringlet::solids
