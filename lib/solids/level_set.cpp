// The only file that sees OpenVDB: its mesh tools take a minute to compile.
//
// OpenVDB rasterises the surface and tells inside from outside by flooding from without, which
// self-intersecting and badly wound meshes survive, and which drops what lies hidden inside. It does so in
// the two voxels next to the surface; distances farther out are OpenVDB's estimates, off by up to a voxel, so
// the rest of the band is measured here against the nearest triangle.
#include "solids/level_set.h"

#include <fmt/format.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <mutex>

#include "core/error.h"
#include "core/trace.h"
#include "solids/closest_triangle.h"
#include "solids/surface_side.h"

namespace ringlet::solids {
namespace {

using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::Int32Grid;
using FloatLeaf = FloatGrid::TreeType::LeafNodeType;
using Int32Leaf = Int32Grid::TreeType::LeafNodeType;

constexpr int kTileEdge = FloatLeaf::DIM;
constexpr std::size_t kTileVoxels = FloatLeaf::SIZE;
constexpr std::int64_t kMostTiles = 1 << 27;  // of the dense table: 512 MB
static_assert(kTileEdge == 8 && kTileVoxels == 512, "kernels::LevelSetView's tiles are OpenVDB's leaves");

struct Tile {
  Coord origin;  // its lowest voxel
  std::array<float, kTileVoxels> distance;
  std::array<std::int32_t, kTileVoxels> triangle;
};

// Tiles sorted by origin, and the dense table over their bounds. `number` is asked for the others'.
LevelSet assemble(const std::vector<std::unique_ptr<Tile>>& tiles, float voxel_size, float background,
                  const std::function<std::int32_t(const Coord&)>& number) {
  LevelSet result;
  result.voxel_size = voxel_size;
  result.background = background;
  if (tiles.empty()) return result;
  openvdb::CoordBBox bounds;
  for (const auto& tile : tiles) bounds.expand(tile->origin >> 3);
  const Coord low = bounds.min(), count = bounds.dim();
  const std::int64_t size = std::int64_t{count.x()} * count.y() * count.z();
  if (count.x() > kMostTiles || count.y() > kMostTiles || count.z() > kMostTiles || size > kMostTiles)
    throw Error(ErrorKind::kInput, "",
                fmt::format("a level set of {} x {} x {} tiles of 8^3 voxels is too large", count.x(),
                            count.y(), count.z()),
                "take a larger voxel");
  for (std::size_t axis = 0; axis < 3; ++axis) {
    result.tile_min[axis] = low[static_cast<int>(axis)];
    result.tile_count[axis] = count[static_cast<int>(axis)];
  }
  result.distance.reserve(tiles.size() * kTileVoxels);
  result.triangle.reserve(tiles.size() * kTileVoxels);
  auto next = tiles.begin();
  for (int x = low.x(); x < low.x() + count.x(); ++x)
    for (int y = low.y(); y < low.y() + count.y(); ++y)
      for (int z = low.z(); z < low.z() + count.z(); ++z) {
        const Coord origin = Coord(x, y, z) << 3;
        if (next == tiles.end() || (*next)->origin != origin) {
          result.tile.push_back(number(origin));
          continue;
        }
        result.tile.push_back(static_cast<std::int32_t>(next - tiles.begin()));
        result.distance.insert(result.distance.end(), (*next)->distance.begin(), (*next)->distance.end());
        result.triangle.insert(result.triangle.end(), (*next)->triangle.begin(), (*next)->triangle.end());
        ++next;
      }
  return result;
}

// ---- Inside and outside -------------------------------------------------------------------------

// Some triangles of a surface in voxels, as meshToVolume wants them.
struct PolygonsInVoxels {
  std::span<const Vec3> points;
  std::span<const Triangle> triangles;
  std::vector<std::int32_t> chosen;

  std::size_t polygonCount() const { return chosen.size(); }
  std::size_t pointCount() const { return points.size(); }
  std::size_t vertexCount(std::size_t) const { return 3; }
  std::array<Vec3, 3> corners(std::int32_t triangle) const {
    const Triangle& t = triangles[static_cast<std::size_t>(triangle)];
    return {points[static_cast<std::size_t>(t[0])], points[static_cast<std::size_t>(t[1])],
            points[static_cast<std::size_t>(t[2])]};
  }
  void getIndexSpacePoint(std::size_t polygon, std::size_t corner, openvdb::Vec3d& point) const {
    const Vec3 p = corners(chosen[polygon])[corner];
    point = {p.x(), p.y(), p.z()};
  }
};

// The triangles with area whose bounds_cavity is `of_cavity`.
PolygonsInVoxels choose(const ClosedSurface& surface, std::span<const Vec3> points, bool of_cavity) {
  PolygonsInVoxels result{points, surface.triangles, {}};
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const auto [a, b, c] = result.corners(static_cast<std::int32_t>(t));
    if (surface.bounds_cavity[t] == of_cavity && (b - a).cross(c - a).squaredNorm() > 0)
      result.chosen.push_back(static_cast<std::int32_t>(t));
  }
  return result;
}

// Negative inside, in voxels; OpenVDB's leaves lie along the surface that can be reached from without.
FloatGrid::Ptr flood(const PolygonsInVoxels& polygons) {
  constexpr float kBand = 2;  // the least, and as far as meshToVolume goes without estimates
  const auto voxels = openvdb::math::Transform::createLinearTransform(1.0);
  return openvdb::tools::meshToVolume<FloatGrid>(polygons, *voxels, kBand, kBand,
                                                 openvdb::tools::DISABLE_RENORMALIZATION);
}

// Leaves out the triangles that lie wholly inside, behind other parts of the surface.
std::vector<std::int32_t> visible(const PolygonsInVoxels& polygons, const FloatGrid& flooded) {
  constexpr float kHidden =
      -1;  // voxels: the voxel nearest to a point of the surface is no farther than 0.87 from it
  const auto voxels = flooded.getConstAccessor();
  const auto is_hidden = [&](const Vec3& p) {
    return voxels.getValue(Coord::round(openvdb::Vec3d(p.x(), p.y(), p.z()))) <= kHidden;
  };
  std::vector<std::int32_t> result;
  for (const std::int32_t t : polygons.chosen) {
    const auto [a, b, c] = polygons.corners(t);
    if (!(is_hidden(a) && is_hidden(b) && is_hidden(c) && is_hidden((a + b + c) / 3))) result.push_back(t);
  }
  return result;
}

// The inside of a solid less its cavities.
struct Interior {
  FloatGrid::Ptr body, cavities;

  // A query for one thread.
  auto query() const {
    return
        [in_body = body->getConstAccessor(), in_cavity = cavities->getConstAccessor()](const Coord& voxel) {
          return in_body.getValue(voxel) < 0 && !(in_cavity.getValue(voxel) < 0);
        };
  }
};

// ---- The band -----------------------------------------------------------------------------------

// Origins of all tiles that may hold voxels of the band, sorted.
std::vector<Coord> tiles_near(const Interior& interior, int half_width) {
  const int reach = (half_width + kTileEdge - 1) / kTileEdge;
  std::vector<Coord> origins;
  for (const FloatGrid::Ptr& grid : {interior.body, interior.cavities})
    for (auto leaf = grid->tree().cbeginLeaf(); leaf; ++leaf)
      for (int x = -reach; x <= reach; ++x)
        for (int y = -reach; y <= reach; ++y)
          for (int z = -reach; z <= reach; ++z)
            origins.push_back(leaf->origin() + Coord(x * kTileEdge, y * kTileEdge, z * kTileEdge));
  std::sort(origins.begin(), origins.end());
  origins.erase(std::unique(origins.begin(), origins.end()), origins.end());
  return origins;
}

// The surface in voxels as the band's voxels ask about it. One for each thread.
class Surroundings {
 public:
  Surroundings(const ClosestTriangle& closest, const SurfaceSide& side, const Interior& interior)
      : closest_(closest), side_(side), flooded_(interior.query()) {}

  ClosestTriangle::Hit nearest(const Eigen::Vector3f& point, float reach, std::int32_t leaf = 0) const {
    return closest_.nearest(point, reach * reach, leaf);
  }

  bool is_inside(const Coord& voxel) const { return flooded_(voxel); }

  // For a voxel this near to a triangle. What the triangle says counts where the flood may be mistaken; but
  // nothing is outside that the flood did not come near, since the triangle may be behind another part of the
  // surface.
  bool is_inside(const Coord& voxel, float distance, std::int32_t triangle) const {
    constexpr float kDoubtful = 0.3f;  // voxels
    const bool flooded = flooded_(voxel);
    if (distance > kDoubtful) return flooded;
    const bool told = side_.is_inside(Vec3(voxel.x(), voxel.y(), voxel.z()), triangle).value_or(flooded);
    if (told || !flooded) return told;
    for (int i = 0; i < 26; ++i)
      if (!flooded_(voxel + openvdb::util::COORD_OFFSETS[i])) return false;
    return true;
  }

 private:
  const ClosestTriangle& closest_;
  const SurfaceSide& side_;
  decltype(std::declval<Interior>().query()) flooded_;
};

// Measures the tile's voxels; none where all are farther than `half_width` voxels from the surface.
std::unique_ptr<Tile> measure(const Coord& origin, const Surroundings& surface, float voxel_size,
                              int half_width) {
  constexpr float kHalfDiagonal = 6.1f;  // voxels, from a tile's middle to its corner voxels
  constexpr float kMargin = 2;  // voxels that a query looks beyond the band, to learn what need not be asked
  const auto position = [](const Coord& voxel) {
    return Eigen::Vector3i(voxel.x(), voxel.y(), voxel.z()).cast<float>().eval();
  };
  const float band = static_cast<float>(half_width), background = band * voxel_size;
  Eigen::Vector3f asked = position(origin) + Eigen::Vector3f::Constant(3.5f);  // the last point asked about
  ClosestTriangle::Hit hit = surface.nearest(asked, band + kHalfDiagonal);
  if (hit.triangle < 0) return nullptr;
  std::int32_t near_by = hit.triangle;
  auto tile = std::make_unique<Tile>();
  tile->origin = origin;
  bool is_near = false;
  for (openvdb::Index i = 0; i < kTileVoxels; ++i) {
    const Coord voxel = origin + FloatLeaf::offsetToLocalCoord(i);
    const Eigen::Vector3f point = position(voxel);
    if (std::sqrt(hit.squared_distance) - (point - asked).norm() < band) {
      hit = surface.nearest(point, band + kMargin, hit.leaf);
      asked = point;
    }
    const float distance = std::sqrt(hit.squared_distance);
    const bool in_band = asked == point && distance < band;
    const bool is_inside =
        in_band ? surface.is_inside(voxel, distance, hit.triangle) : surface.is_inside(voxel);
    tile->distance[i] = (is_inside ? -1 : 1) * (in_band ? distance * voxel_size : background);
    if (hit.triangle >= 0) near_by = hit.triangle;
    tile->triangle[i] = in_band || is_inside ? near_by : -1;
    is_near = is_near || in_band;
  }
  return is_near ? std::move(tile) : nullptr;
}

}  // namespace

kernels::LevelSetView LevelSet::view() const {
  return {voxel_size,
          background,
          {tile_min[0], tile_min[1], tile_min[2]},
          {tile_count[0], tile_count[1], tile_count[2]},
          tile.data(),
          distance.data(),
          triangle.data()};
}

std::size_t LevelSet::bytes() const {
  return tile.size() * sizeof tile[0] + distance.size() * sizeof distance[0] +
         triangle.size() * sizeof triangle[0];
}

namespace {

// OpenVDB registers its types when the first level set is asked for: a run without solids never gets here.
void open_openvdb() {
  static std::once_flag once;
  std::call_once(once, [] {
    const trace::Span span("OpenVDB", "set-up");
    openvdb::initialize();
  });
}

}  // namespace

bool LevelSet::encloses_volume() const {
  return std::any_of(distance.begin(), distance.end(), [](float d) { return d < 0; });
}

LevelSet build_level_set(const ClosedSurface& surface, std::span<const Eigen::Vector3f> vertices,
                         float voxel_size, int half_width) {
  open_openvdb();
  std::vector<Vec3> points;
  points.reserve(vertices.size());
  for (const Eigen::Vector3f& v : vertices)
    points.push_back(v.cast<double>() / static_cast<double>(voxel_size));
  const PolygonsInVoxels body = choose(surface, points, false), cavities = choose(surface, points, true);
  const Interior interior{flood(body), flood(cavities)};
  std::vector<std::int32_t> seen = visible(body, *interior.body);
  const std::vector<std::int32_t> seen_cavities = visible(cavities, *interior.cavities);
  seen.insert(seen.end(), seen_cavities.begin(), seen_cavities.end());
  const ClosestTriangle closest(points, surface.triangles, seen);
  const SurfaceSide side(surface, points);

  const std::vector<Coord> origins = tiles_near(interior, half_width);
  std::vector<std::unique_ptr<Tile>> tiles(origins.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, origins.size()), [&](const auto& range) {
    const Surroundings surroundings(closest, side, interior);
    for (std::size_t i = range.begin(); i != range.end(); ++i)
      tiles[i] = measure(origins[i], surroundings, voxel_size, half_width);
  });
  std::erase(tiles, nullptr);
  const auto number = [&, is_inside = interior.query()](const Coord& origin) {
    if (!is_inside(origin)) return kernels::kTileOutside;
    constexpr float kAnywhere = 1e30f;
    const Coord middle = origin.offsetBy(kTileEdge / 2);
    return kernels::kTileInside -
           closest.nearest({float(middle.x()), float(middle.y()), float(middle.z())}, kAnywhere).triangle;
  };
  return assemble(tiles, voxel_size, static_cast<float>(half_width) * voxel_size, number);
}

// ---- Files --------------------------------------------------------------------------------------

namespace {

constexpr const char* kDistanceGrid = "distance";
constexpr const char* kTriangleGrid = "triangle";

template <class Grid>
typename Grid::Ptr empty_grid(const char* name, typename Grid::ValueType background, float voxel_size) {
  auto grid = Grid::create(background);
  grid->setName(name);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(static_cast<double>(voxel_size)));
  return grid;
}

// Every tile of the table with its origin.
void for_each_tile(const LevelSet& level_set, const std::function<void(const Coord&, std::int32_t)>& visit) {
  const auto& [nx, ny, nz] = level_set.tile_count;
  std::size_t i = 0;
  for (int x = 0; x < nx; ++x)
    for (int y = 0; y < ny; ++y)
      for (int z = 0; z < nz; ++z)
        visit((Coord(x, y, z) + Coord(level_set.tile_min[0], level_set.tile_min[1], level_set.tile_min[2]))
                  << 3,
              level_set.tile[i++]);
}

openvdb::GridPtrVec to_grids(const LevelSet& level_set) {
  auto distance = empty_grid<FloatGrid>(kDistanceGrid, level_set.background, level_set.voxel_size);
  auto triangle = empty_grid<Int32Grid>(kTriangleGrid, -1, level_set.voxel_size);
  distance->setGridClass(openvdb::GRID_LEVEL_SET);
  for_each_tile(level_set, [&](const Coord& origin, std::int32_t tile) {
    if (tile <= kernels::kTileInside) {
      distance->tree().addTile(1, origin, -level_set.background, false);
      triangle->tree().addTile(1, origin, kernels::kTileInside - tile, false);
    }
    if (tile < 0) return;
    FloatLeaf& distance_leaf = *distance->tree().touchLeaf(origin);
    Int32Leaf& triangle_leaf = *triangle->tree().touchLeaf(origin);
    for (openvdb::Index i = 0; i < kTileVoxels; ++i) {
      const std::size_t voxel = static_cast<std::size_t>(tile) * kTileVoxels + i;
      const bool in_band = std::abs(level_set.distance[voxel]) < level_set.background;
      distance_leaf.setValueOnly(i, level_set.distance[voxel]);
      triangle_leaf.setValueOnly(i, level_set.triangle[voxel]);
      distance_leaf.setActiveState(i, in_band);
      triangle_leaf.setActiveState(i, in_band);
    }
  });
  return {distance, triangle};
}

LevelSet from_grids(const FloatGrid& distance, const Int32Grid& triangle, std::size_t triangle_count) {
  const auto refuse = [] { throw std::runtime_error("its contents are not a level set of this surface"); };
  std::vector<std::unique_ptr<Tile>> tiles;
  for (auto leaf = distance.tree().cbeginLeaf(); leaf; ++leaf) {
    const Int32Leaf* triangles = triangle.tree().probeConstLeaf(leaf->origin());
    if (triangles == nullptr) refuse();
    auto tile = std::make_unique<Tile>();
    tile->origin = leaf->origin();
    for (openvdb::Index i = 0; i < kTileVoxels; ++i) {
      tile->distance[i] = leaf->getValue(i);
      tile->triangle[i] = triangles->getValue(i);
      const bool known =
          tile->triangle[i] >= -1 && tile->triangle[i] < static_cast<std::int64_t>(triangle_count);
      if (!known || !(std::abs(tile->distance[i]) <= distance.background())) refuse();
    }
    tiles.push_back(std::move(tile));
  }
  std::sort(tiles.begin(), tiles.end(), [](const auto& a, const auto& b) { return a->origin < b->origin; });
  const auto values = distance.getConstAccessor();
  const auto triangles = triangle.getConstAccessor();
  const auto number = [&](const Coord& origin) {
    if (values.getValue(origin) >= 0) return kernels::kTileOutside;
    const std::int32_t near_by = triangles.getValue(origin);
    if (near_by < 0 || near_by >= static_cast<std::int64_t>(triangle_count)) refuse();
    return kernels::kTileInside - near_by;
  };
  return assemble(tiles, static_cast<float>(distance.voxelSize()[0]), distance.background(), number);
}

}  // namespace

void write_level_set(const std::filesystem::path& file, const LevelSet& level_set) {
  open_openvdb();
  try {
    openvdb::io::File out(file.string());
    out.write(to_grids(level_set));
    out.close();
  } catch (const std::exception& error) {
    throw Error(ErrorKind::kIo, file.string(), std::string("cannot write the level set: ") + error.what());
  }
}

LevelSet read_level_set(const std::filesystem::path& file, std::size_t triangle_count) {
  open_openvdb();
  try {
    openvdb::io::File in(file.string());
    in.open(false);
    const auto distance = openvdb::gridPtrCast<FloatGrid>(in.readGrid(kDistanceGrid));
    const auto triangle = openvdb::gridPtrCast<Int32Grid>(in.readGrid(kTriangleGrid));
    if (!distance || !triangle) throw std::runtime_error("its grids are of other types");
    return from_grids(*distance, *triangle, triangle_count);
  } catch (const std::exception& error) {
    throw Error(ErrorKind::kIo, file.string(), std::string("cannot read the level set: ") + error.what());
  }
}

}  // namespace ringlet::solids
