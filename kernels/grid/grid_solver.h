// Hair against hair as a fluid: one run of the grid reads like its table of contents (grid_step.h has the
// terms).
#pragma once
#include "kernels/grid/fluid.h"
#include "kernels/grid/hair_grid.h"
#include "kernels/grid/hair_shelter.h"
#include "kernels/grid/pressure.h"

namespace ringlet::kernels {

inline namespace RINGLET_ISA {

template <class Backend, class T>
class GridSolver final : public HairGrid<T> {
 public:
  template <class V>
  using Buffer = typename Backend::template Buffer<V>;

  explicit GridSolver(const typename Backend::Lent& lent) : backend_(lent) {}

  void at_rest(const GridStep<T>& step) override {
    number_particles(step);
    if (data_.particles == 0) return;
    most_rest_density_ = kLeastStrands;
    backend_.parallel_for("grid: rest density", samples_, [g = data_] RINGLET_LAMBDA(int s) {
      g.rest_density[s] = static_cast<T>(kLeastStrands);
    });
    // Where the lattice lies beside the hair is chance: the rest state is looked at by eight of them.
    for (int shift = 0; shift < 8; ++shift) {
      data_.step.axes = shifted(step.axes, shift);
      fill();
      backend_.parallel_for(
          "grid: rest density", data_.occupied, [g = data_] RINGLET_LAMBDA(int t) { rest_densities(g, t); },
          kTileChunk);
      most_rest_density_ = backend_.largest(
          "grid: rest density", samples_, kLeastStrands,
          [g = data_] RINGLET_LAMBDA(int s) { return static_cast<double>(g.rest_density[s]); });
    }
    // What the first run will want is there before it: plans tell it.
    data_.step.axes = step.axes;
    fill();
    find_fluid();
    find_walls();
    assemble();
  }

  GridFigures run(const GridStep<T>& step) override {
    GridFigures figures;
    data_.step = step;
    if (data_.particles == 0) return figures;
    for (int pass = 0; pass < step.passes; ++pass) {
      fill();
      find_fluid();
      find_walls();
      const double density = densest();
      if (pass == 0) figures.cells = data_.cells, figures.density = density;
      const bool dense = density > 1 + kOverDense;
      if (pass > 0 && !dense) break;
      assemble();
      if (pass == 0)
        keep_volume(figures);
      else
        leave_velocities();
      if (dense) move_apart(figures);
      give_back_all(dense);
      figures.moved = figures.moved || dense;
    }
    return figures;
  }

  void shelter(const HairShelter<T>& shelter) override {
    if (data_.particles == 0) return;
    tile_density_.resize(data_.tiles), tile_depth_.resize(data_.tiles);
    const TileShelter<T> found = tile_shelter(shelter);
    backend_.parallel_for(
        "grid: mean density", data_.tiles,
        [g = data_, found] RINGLET_LAMBDA(int tile) { found.tile_density[tile] = mean_density(g, tile); },
        kTileChunk);
    backend_.parallel_for(
        "grid: depth", data_.tiles,
        [g = data_, found] RINGLET_LAMBDA(int tile) {
          found.tile_depth[tile] = depth_before(g, found, tile);
        },
        kTileChunk);
    backend_.parallel_for(
        "grid: shelter", data_.lanes,
        [g = data_, found, share = shelter.share] RINGLET_LAMBDA(int s) {
          shelter_segments(g, found, share, s);
        },
        256);
  }

  std::size_t bytes() const override {
    return backend_.bytes() + pressure_.bytes() + first_particle_.bytes() + ends_.bytes() +
           first_sample_.bytes() + rest_density_.bytes() + particle_.bytes() + first_piece_.bytes() +
           reach_.bytes() + tile_pieces_.bytes() + piece_.bytes() + piece_key_.bytes() + piece_of_.bytes() +
           given_back_.bytes() + tile_key_.bytes() + near_.bytes() + occupied_key_.bytes() +
           occupied_tile_.bytes() + tile_piece_.bytes() + flag_.bytes() + around_key_.bytes() +
           around_.bytes() + node_.bytes() + lightness_.bytes() + wall_.bytes() + opening_.bytes() +
           wall_part_.bytes() + fluid_.bytes() + rows_.bytes() + first_cell_.bytes() + tile_density_.bytes() +
           tile_depth_.bytes();
  }

  // Without wind there is no upwind: no tile is before another.
  TileShelter<T> tile_shelter(const HairShelter<T>& shelter) const {
    const GridAxes& axes = data_.step.axes;
    const double* wind = shelter.wind;
    const double speed = __builtin_sqrt(wind[0] * wind[0] + wind[1] * wind[1] + wind[2] * wind[2]);
    TileShelter<T> found{{}, 0, tile_density_.data(), tile_depth_.data()};
    for (int c = 0; c < 3 && speed > 0; ++c)
      found.upwind[c] =
          -(axes.rotation[c] * wind[0] + axes.rotation[3 + c] * wind[1] + axes.rotation[6 + c] * wind[2]) /
          speed;
    if (speed > 0) found.per_tile = shelter.strength * 2 * shelter.radius * kTileEdge / axes.cell;
    return found;
  }

  // The same axes, half a cell aside along those whose bits are set.
  static GridAxes shifted(GridAxes axes, int shift) {
    for (int axis = 0; axis < 3; ++axis)
      for (int c = 0; c < 3; ++c)
        if (shift >> axis & 1) axes.origin[c] += 0.5 * axes.cell * axes.rotation[3 * c + axis];
    return axes;
  }

  // ---- The strands' numbers

  void number_particles(const GridStep<T>& step) {
    data_ = {};
    data_.step = step;
    data_.lanes = step.batches.batches * kLanes;
    first_particle_.resize(data_.lanes + 1);
    std::int32_t* first = first_particle_.data();
    const StrandBatches<T> batches = step.batches;
    const std::int32_t lanes = data_.lanes;
    backend_.parallel_for("grid: strands", lanes + 1, [=] RINGLET_LAMBDA(int strand) {
      const std::int32_t count = strand < lanes ? static_cast<std::int32_t>(batches.count[strand]) : 0;
      first[strand] = count > 1 ? count : 0;
    });
    data_.particles = backend_.scan("grid: strands", first_particle_, lanes + 1);
    reach_.resize(data_.lanes);
    data_.first_particle = first, data_.reach = reach_.data();
    ends_.resize(data_.particles + 1), first_sample_.resize(data_.particles + 1);
    particle_.resize(std::size_t{8} * (data_.particles + 1)), first_piece_.resize(data_.particles + 1);
    number_samples(step);
  }

  // As many of a segment as it is cells long at rest.
  void number_samples(const GridStep<T>& step) {
    unsigned char* ends = ends_.data();
    std::int32_t* samples = first_sample_.data();
    const GridData<T> g = data_;
    backend_.parallel_for("grid: samples", g.lanes, [=] RINGLET_LAMBDA(int strand) {
      const int first = g.first_particle[strand], count = g.first_particle[strand + 1] - first;
      const std::int64_t row = g.step.batches.row[strand / kLanes];
      for (int i = 0; i < count; ++i) {
        const T length = g.step.batches.rest_length[(row + i) * 3 * kLanes + strand % kLanes];
        const T cells = length / static_cast<T>(g.step.axes.cell);
        const bool last = i + 1 == count;
        ends[first + i] =
            static_cast<unsigned char>((i == 0 ? kFirstOfStrand : 0) | (last ? kLastOfStrand : 0));
        samples[first + i] = last ? 0 : 1 + static_cast<std::int32_t>(min(cells, T(kMostSamples)));
      }
    });
    const std::int32_t particles = data_.particles;
    backend_.parallel_for("grid: samples", 1,
                          [=] RINGLET_LAMBDA(int) { samples[particles] = 0, ends[particles] = 0; });
    samples_ = backend_.scan("grid: samples", first_sample_, particles + 1);
    rest_density_.resize(samples_);
    data_.ends = ends, data_.first_sample = samples, data_.rest_density = rest_density_.data();
    data_.particle = particle_.data(), data_.first_piece = first_piece_.data();
    data_.step = step;
  }

  // ---- From strands to nodes

  void fill() {
    backend_.parallel_for(
        "grid: place", data_.lanes, [g = data_] RINGLET_LAMBDA(int s) { place_strand(g, s); }, 256);
    const int bits = find_bounds();
    backend_.parallel_for("grid: shift", data_.particles,
                          [g = data_] RINGLET_LAMBDA(int i) { shift_particle(g, i); });
    cut_pieces(bits);
    find_tiles(bits);
    scatter();
  }

  // The coordinates of the lowest tile, one lower for the halo; returns how many bits a key needs.
  int find_bounds() {
    int bits = 1;
    for (int c = 0; c < 3; ++c) {
      data_.low[c] = -furthest(c, -1) - 1;
      data_.extent[c] = furthest(c, 1) + 2 - data_.low[c];
      while (data_.extent[c] > 1 << bits) ++bits;
    }
    return 3 * bits;
  }
  // The last tile with a particle along an axis, or against it (`sign` -1).
  std::int32_t furthest(int axis, int sign) {
    return static_cast<std::int32_t>(backend_.largest(
        "grid: bounds", data_.lanes, -kFarCells, [reach = data_.reach, axis, sign] RINGLET_LAMBDA(int s) {
          const T end = sign > 0 ? reach[s].high[axis] : reach[s].low[axis];
          return static_cast<double>(sign) * (floor_to_int(end) >> 2);
        }));
  }

  void cut_pieces(int bits) {
    std::int32_t* count = first_piece_.data();
    backend_.parallel_for("grid: count pieces", data_.particles,
                          [g = data_, count] RINGLET_LAMBDA(int i) { count[i] = count_pieces(g, i); });
    const std::int32_t particles = data_.particles;
    backend_.parallel_for("grid: count pieces", 1, [=] RINGLET_LAMBDA(int) { count[particles] = 0; });
    data_.pieces = backend_.scan("grid: count pieces", first_piece_, particles + 1);
    piece_.resize(data_.pieces), piece_key_.resize(data_.pieces), piece_of_.resize(data_.pieces);
    given_back_.resize(std::size_t{2 * 8} * data_.pieces);
    data_.piece = piece_.data(), data_.given_back = given_back_.data();
    data_.piece_key = piece_key_.data(), data_.piece_of = piece_of_.data();
    backend_.parallel_for("grid: cut pieces", data_.particles, [g = data_] RINGLET_LAMBDA(int i) {
      for_each_piece(g, i, [&](const Piece& piece, std::int32_t x, std::int32_t y, std::int32_t z) {
        g.piece[piece.number] = piece, g.piece_key[piece.number] = key_of(x, y, z);
        g.piece_of[piece.number] = static_cast<std::uint32_t>(piece.number);
      });
    });
    backend_.sort("grid: sort pieces", piece_key_, piece_of_, data_.pieces, bits);
    data_.piece_key = piece_key_.data(), data_.piece_of = piece_of_.data();
  }

  // The tiles that pieces lie in, those about them, and where each tile's neighbours are.
  void find_tiles(int bits) {
    occupied_key_.resize(data_.pieces);
    tile_piece_.resize(data_.pieces + 1);
    data_.occupied = unique(piece_key_.data(), data_.pieces, occupied_key_, &tile_piece_);
    tile_pieces_.resize(data_.pieces);
    data_.tile_piece = tile_piece_.data(), data_.tile_pieces = tile_pieces_.data();
    const std::int32_t candidates = data_.occupied * kAround;
    around_key_.resize(candidates), around_.resize(candidates);
    std::uint64_t* around = around_key_.data();
    const std::uint64_t* occupied = occupied_key_.data();
    // One that is not reached is the tile itself, again.
    backend_.parallel_for(
        "grid: dilate", data_.occupied,
        [g = data_, around, occupied] RINGLET_LAMBDA(int t) {
          const std::uint32_t reached = collect_pieces(g, t);
          for (int n = 0; n < kAround; ++n)
            around[t * kAround + n] = reached >> n & 1 ? key_around(occupied[t], n) : occupied[t];
        },
        kTileChunk);
    backend_.sort("grid: dilate", around_key_, around_, candidates, bits);
    tile_key_.resize(candidates);
    data_.tiles = unique(around_key_.data(), candidates, tile_key_, nullptr);
    find_neighbours();
  }

  // The different keys of a sorted list, and where each begins.
  std::int32_t unique(const std::uint64_t* sorted, std::int32_t n, Buffer<std::uint64_t>& different,
                      Buffer<std::int32_t>* begin) {
    flag_.resize(n + 1);
    std::int32_t* number = flag_.data();
    backend_.parallel_for("grid: different tiles", n + 1, [=] RINGLET_LAMBDA(int i) {
      number[i] = i < n && (i == 0 || sorted[i] != sorted[i - 1]) ? 1 : 0;
    });
    const std::int32_t count = backend_.scan("grid: different tiles", flag_, n + 1);
    std::uint64_t* to = different.data();
    std::int32_t* starts = begin ? begin->data() : nullptr;
    backend_.parallel_for("grid: different tiles", n, [=] RINGLET_LAMBDA(int i) {
      if (i > 0 && sorted[i] == sorted[i - 1]) return;
      to[number[i]] = sorted[i];
      if (starts) starts[number[i]] = i;
    });
    if (starts)
      backend_.parallel_for("grid: different tiles", 1, [=] RINGLET_LAMBDA(int) { starts[count] = n; });
    return count;
  }

  void find_neighbours() {
    near_.resize(std::size_t{kAround} * data_.tiles), occupied_tile_.resize(data_.occupied);
    data_.tile_key = tile_key_.data(), data_.near = near_.data();
    std::int32_t* tile_of = occupied_tile_.data();
    data_.occupied_tile = tile_of;
    const std::uint64_t* occupied = occupied_key_.data();
    backend_.parallel_for(
        "grid: tiles", data_.occupied,
        [g = data_, tile_of, occupied] RINGLET_LAMBDA(int t) {
          tile_of[t] = find_key(g.tile_key, g.tiles, occupied[t]);
        },
        kTileChunk);
    backend_.parallel_for(
        "grid: neighbours", data_.tiles, [g = data_] RINGLET_LAMBDA(int tile) { find_near(g, tile); },
        kTileChunk);
    backend_.parallel_for(
        "grid: neighbours", data_.occupied, [g = data_] RINGLET_LAMBDA(int t) { find_around(g, t); },
        kTileChunk);
  }

  void scatter() {
    const std::size_t nodes = static_cast<std::size_t>(data_.tiles) * kTileCells;
    node_.resize(nodes * kNodeValues), lightness_.resize(nodes * 3);
    rows_.resize(data_.occupied);
    data_.node = node_.data(), data_.lightness = lightness_.data(), data_.rows = rows_.data();
    choose_scale();
    backend_.parallel_for(
        "grid: clear", data_.tiles,
        [g = data_] RINGLET_LAMBDA(int tile) {
          Fixed<T>* sums = sums_of(g, static_cast<std::int64_t>(tile) * kTileCells);
          for (int v = 0; v < kTileCells * kNodeValues; ++v) sums[v] = 0;
        },
        kTileChunk);
    constexpr int kTogether = Backend::kCallsShareThreads ? 3 : 0;
    for (int colour = 0; colour < kColours; ++colour)
      backend_.parallel_for(
          "grid: scatter", data_.occupied,
          [g = data_, colour] RINGLET_LAMBDA(int t) {
            const auto block = [&](int at) { return block_of(g.tile_key[g.occupied_tile[at]], kTogether); };
            const std::uint64_t own = block(t);
            if (colour_of(own) != colour || (t > 0 && block(t - 1) == own)) return;
            for (int at = t; at < g.occupied && block(at) == own; ++at) scatter_tile(g, at);
          },
          2 * kTileChunk);
    backend_.parallel_for(
        "grid: nodes", data_.tiles, [g = data_] RINGLET_LAMBDA(int tile) { finish_tile(g, tile); },
        kTileChunk);
  }

  // As fine as the largest sum allows: a node gets from no more than eight tiles.
  void choose_scale() {
    const double samples =
        backend_.largest("grid: samples", data_.occupied, 1, [g = data_] RINGLET_LAMBDA(int t) {
          double count = 0;
          for (std::int32_t q = g.tile_piece[t]; q < g.tile_piece[t + 1]; ++q)
            count += g.tile_pieces[q].end - g.tile_pieces[q].first;
          return count;
        });
    const double speed = backend_.largest(
        "grid: speed", data_.lanes, 1e-30,
        [reach = data_.reach] RINGLET_LAMBDA(int s) { return static_cast<double>(reach[s].speed); });
    constexpr int kMostWeight = kMostSampleLength > kMostSampleMass ? kMostSampleLength : kMostSampleMass;
    const double unit = 0.9 * FixedPoint<T>::kRange / (8.0 * kMostWeight * samples);
    for (int v = 0; v < kNodeValues; ++v) data_.scale[v] = static_cast<T>(unit);
    data_.scale[kTarget] = static_cast<T>(unit / most_rest_density_);
    for (int v = kFaceMass + 1; v < kNodeValues; v += 2) data_.scale[v] = static_cast<T>(unit / speed);
  }

  // ---- Cells

  void find_walls() {
    const std::int32_t parts = data_.tiles * kTileParts;
    wall_.resize(parts), flag_.resize(parts + 1);
    std::int32_t *number = flag_.data(), *wall = wall_.data();
    data_.wall = wall;
    backend_.parallel_for(
        "grid: near walls", parts + 1,
        [g = data_, number, parts] RINGLET_LAMBDA(int part) {
          number[part] = part < parts && part_has_fluid_faces(g, part) && near_wall(g, part) ? 1 : 0;
        },
        kTileChunk * kTileParts);
    const std::int32_t walls = backend_.scan("grid: near walls", flag_, parts + 1);
    wall_part_.resize(walls), opening_.resize(static_cast<std::size_t>(walls) * kPartCells * kWallValues);
    std::int32_t* part_of = wall_part_.data();
    data_.opening = opening_.data();
    backend_.parallel_for("grid: near walls", parts, [=] RINGLET_LAMBDA(int part) {
      const bool is_near = number[part + 1] != number[part];
      wall[part] = is_near ? number[part] : -1;
      if (is_near) part_of[number[part]] = part;
    });
    backend_.parallel_for(
        "grid: walls", walls, [g = data_, part_of] RINGLET_LAMBDA(int n) { find_openings(g, part_of[n]); },
        kTileParts);
  }

  void find_fluid() {
    fluid_.resize(data_.tiles), first_cell_.resize(data_.tiles + 1);
    data_.fluid = fluid_.data();
    std::int32_t* count = first_cell_.data();
    backend_.parallel_for(
        "grid: fluid", data_.tiles + 1,
        [g = data_, count] RINGLET_LAMBDA(int tile) {
          count[tile] = tile < g.tiles ? ones(g.fluid[tile] = fluid_cells(g, tile)) : 0;
        },
        kTileChunk);
    data_.cells = backend_.scan("grid: fluid", first_cell_, data_.tiles + 1);
    data_.first_cell = count;
  }

  // The largest density over its target.
  double densest() {
    return backend_.largest("grid: densest", data_.tiles, 0, [g = data_] RINGLET_LAMBDA(int tile) {
      double most = 0;
      for_each_cell(g, tile, [&](std::int64_t node, std::int32_t) {
        const T* values = g.node + node * kNodeValues;
        const double share = static_cast<double>(values[kDensity]) / static_cast<double>(values[kTarget]);
        most = share > most ? share : most;
      });
      return most;
    });
  }

  // The operator, and by how much each cell would be compressed in the interval beyond what it may.
  void assemble() {
    if (data_.cells == 0) return;
    backend_.parallel_for(
        "grid: lightness", data_.tiles,
        [g = data_] RINGLET_LAMBDA(int tile) {
          if (has_fluid_faces(g, tile)) find_lightness(g, tile);
        },
        kTileChunk);
    auto& fine = pressure_.multigrid.level[0];
    fine.resize(data_.cells);
    pressure_.resize(data_.cells);
    std::uint64_t* key = fine.key.data();
    std::int32_t* neighbour = fine.neighbour.data();
    T *face = pressure_.face.data(), *open = pressure_.open.data(), *right = pressure_.right.data();
    const T rate = static_cast<T>(data_.step.axes.cell / data_.step.interval);
    backend_.parallel_for(
        "grid: assemble", data_.tiles,
        [=, g = data_] RINGLET_LAMBDA(int tile) {
          for_each_cell(g, tile, [&](std::int64_t node, std::int32_t i) {
            key[i] = g.tile_key[tile] << 6 | static_cast<std::uint64_t>(node % kTileCells);
            const CellRow<T> row(g, node, i);
            for (int d = 0; d < kDirections; ++d) {
              const std::int64_t at = static_cast<std::int64_t>(d) * g.cells + i;
              neighbour[at] = row.neighbour[d], face[at] = row.face[d];
            }
            open[i] = row.open;
            right[i] = row.open > T(0)
                           ? fma(rate, least_divergence(g.node + node * kNodeValues), -row.outflow)
                           : T(0);
          });
        },
        kTileChunk);
    pressure_.prepare(backend_);
  }

  // Calls f(node, number) for the fluid cells of a tile.
  template <class F>
  RINGLET_FUNCTION static void for_each_cell(const GridData<T>& g, std::int32_t tile, const F& f) {
    std::int32_t number = g.first_cell[tile];
    for_each_bit(g.fluid[tile],
                 [&](int cell) { f(static_cast<std::int64_t>(tile) * kTileCells + cell, number++); });
  }

  // ---- From nodes to strands

  // Velocities that the pressure changes, and friction among neighbours.
  void keep_volume(GridFigures& figures) {
    if (data_.cells > 0) solve(figures);
    press(data_.step.pic, pressure_.pressure.data());
  }
  void leave_velocities() { press(T(0), nullptr); }

  void press(T pic, const double* pressure) {
    data_.step.pic = pic;
    backend_.parallel_for(
        "grid: press", data_.tiles,
        [g = data_, pressure] RINGLET_LAMBDA(int tile) { press_velocities(g, pressure, tile); }, kTileChunk);
  }

  // Positions, where hair is too dense: displacement that leaves velocities alone adds no energy.
  void move_apart(GridFigures& figures) {
    T* right = pressure_.right.data();
    const T* open = pressure_.open.data();
    backend_.parallel_for(
        "grid: over density", data_.tiles,
        [=, g = data_] RINGLET_LAMBDA(int tile) {
          for_each_cell(g, tile, [&](std::int64_t node, std::int32_t i) {
            right[i] = open[i] > T(0) ? wanted_divergence(g.node + node * kNodeValues) : T(0);
          });
        },
        kTileChunk);
    solve(figures);
    const double* pressure = pressure_.pressure.data();
    backend_.parallel_for(
        "grid: press", data_.tiles,
        [g = data_, pressure] RINGLET_LAMBDA(int tile) { press_places(g, pressure, tile); }, kTileChunk);
  }

  void solve(GridFigures& figures) {
    const PressureFigures told = pressure_.solve(backend_, data_.step.residual, data_.step.most_iterations);
    figures.iterations += told.iterations;
    figures.residual = told.residual > figures.residual ? told.residual : figures.residual;
    figures.solves += told.compressed ? 1 : 0;
  }

  void give_back_all(bool moved) {
    data_.moved = moved;
    backend_.parallel_for(
        "grid: gather", data_.occupied, [g = data_] RINGLET_LAMBDA(int t) { gather_tile(g, t); }, kTileChunk);
    backend_.parallel_for(
        "grid: give back", data_.lanes, [g = data_] RINGLET_LAMBDA(int s) { give_back(g, s); }, 256);
  }

 private:
  static constexpr int kTileChunk = 16;
  static constexpr int kMostSamples = 4096;  // of a segment

  Backend backend_;
  GridData<T> data_{};
  std::int32_t samples_ = 0;
  double most_rest_density_ = 1;
  Pressure<Backend, T> pressure_;
  Buffer<std::int32_t> first_particle_, first_sample_, first_piece_, near_, occupied_tile_, tile_piece_,
      flag_, wall_, wall_part_, first_cell_;
  Buffer<unsigned char> ends_;
  Buffer<T> tile_density_, tile_depth_;
  Buffer<T> rest_density_, particle_, given_back_, node_, lightness_, opening_;
  Buffer<StrandReach<T>> reach_;
  Buffer<Piece> piece_, tile_pieces_;
  Buffer<std::uint64_t> piece_key_, tile_key_, occupied_key_, around_key_, fluid_, rows_;
  Buffer<std::uint32_t> piece_of_, around_;
};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
