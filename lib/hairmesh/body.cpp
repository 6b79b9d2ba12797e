#include "hairmesh/body.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/error.h"
#include "solids/rigid_fit.h"

namespace ringlet::hairmesh {
namespace {

kernels::HairMeshTopology topology_of(const groom::HairMesh& mesh) {
  std::vector<kernels::ScalpFace> faces;
  for (const groom::HairMesh::Face& face : mesh.faces) faces.push_back({face});
  return kernels::make_hair_mesh_topology(std::move(faces), static_cast<std::int32_t>(mesh.vertices()),
                                          mesh.layers);
}

kernels::HairMeshParameters parameters_of(const scene::HairMeshModel& model) {
  kernels::HairMeshParameters parameters;
  parameters.density = model.density;
  parameters.stretch = model.stretch, parameters.stretch_across = model.stretch_across;
  parameters.shear = model.shear, parameters.horizontal = model.horizontal;
  parameters.bend = model.bend, parameters.bend_across = model.bend_across;
  parameters.volume = model.volume;
  parameters.damping = model.damping, parameters.drag = model.drag;
  parameters.tolerance = model.residual, parameters.iterations = model.max_iterations;
  return parameters;
}

Vec3 mean_root(std::span<const Pose> roots) {
  Vec3 sum = Vec3::Zero();
  for (const Pose& root : roots) sum += root.position;
  return sum / static_cast<double>(roots.size());
}

// The larger one; what is not a number is worst.
double worse(double a, double b) { return b <= a ? a : b; }

template <class V>
std::vector<std::byte> bytes_of(const std::vector<V>& values) {
  std::vector<std::byte> bytes(values.size() * sizeof(V));
  std::memcpy(bytes.data(), values.data(), bytes.size());
  return bytes;
}

const std::vector<std::byte>& array_of(const state::Snapshot& snapshot, const std::string& name,
                                       std::size_t unit, std::optional<std::size_t> count) {
  const auto found = snapshot.arrays.find(name);
  if (found == snapshot.arrays.end() || found->second.size() % unit != 0 ||
      (count && found->second.size() != *count * unit))
    throw Error(ErrorKind::kInput, "state", fmt::format("`{}` is missing or of another size", name),
                "run without --resume");
  return found->second;
}

}  // namespace

groom::Strands columns_of(const groom::HairMesh& mesh) {
  groom::Strands columns;
  for (std::size_t c = 0; c < mesh.vertices(); ++c) {
    for (int l = 0; l < mesh.layers; ++l) columns.points.push_back(mesh.layer(l)[c]);
    columns.offsets.push_back(static_cast<std::int64_t>(columns.points.size()));
  }
  columns.groups.assign(mesh.vertices(), 0);
  columns.group_names = {"columns"};
  return columns;
}

template <class T>
Body<T>::Body(const groom::HairMesh& rest, const scene::HairMeshModel& model, std::span<const Pose> roots,
              kernels::InstructionSet set)
    : model_(model),
      columns_(rest.vertices()),
      layers_(rest.layers),
      rest_(rest.positions),
      rest_roots_(rest.layer(0).begin(), rest.layer(0).end()),
      origin_(mean_root(roots)),
      positions_(rest.positions.size()),
      velocities_(rest.positions.size()),
      solver_positions_(3 * rest.positions.size()),
      solver_velocities_(3 * rest.positions.size()),
      roots_(3 * columns_) {
  Vec3 centre = Vec3::Zero();  // rest shapes too are small numbers wherever the groom is
  for (const Vec3& root : rest_roots_) centre += root / static_cast<double>(columns_);
  std::vector<double> numbered(3 * rest_.size());
  for (std::size_t c = 0; c < columns_; ++c)
    for (int l = 0; l < layers_; ++l)
      for (int k = 0; k < 3; ++k)
        numbered[3 * solver_index(c, l) + k] = rest_[l * columns_ + c][k] - centre[k];
  solver_ = kernels::make_hair_mesh_solver<T>(set, topology_of(rest), numbered, parameters_of(model));
  rest_volume_ = solver_->volume();
  start(roots);
}

template <class T>
void Body<T>::start(std::span<const Pose> roots) {
  for (int l = 0; l < layers_; ++l)
    for (std::size_t c = 0; c < columns_; ++c) {
      const Vec3 out = model_.start == scene::HairMeshStart::kCollapsed
                           ? Vec3(Vec3::Zero())
                           : Vec3(roots[c].rotation * (rest_[l * columns_ + c] - rest_roots_[c]));
      positions_[l * columns_ + c] = roots[c].position + out;
    }
  std::fill(velocities_.begin(), velocities_.end(), Vec3::Zero());
  hand_over();
  fetch();  // as the solver rounds them: a run that begins anew from here sees no others
}

template <class T>
void Body<T>::assemble(double step, std::span<const Pose> roots, const Vec3& gravity,
                       std::span<const Vec3> air) {
  std::vector<Vec3> now;
  for (std::size_t c = 0; c < columns_; ++c) {
    now.push_back(roots[c].position);
    for (int k = 0; k < 3; ++k) roots_[3 * c + k] = static_cast<T>(roots[c].position[k] - origin_[k]);
  }
  kernels::HairMeshStep<T> told{};
  told.step = static_cast<T>(step);
  told.roots = roots_.data();
  const Mat3 turn = solids::fit_pose(rest_roots_, now).rotation;
  for (int k = 0; k < 3; ++k) {
    told.gravity[k] = static_cast<T>(gravity[k]);
    for (int j = 0; j < 3; ++j) told.rotation[3 * k + j] = static_cast<T>(turn(k, j));
  }
  if (!air.empty()) {
    air_.resize(solver_positions_.size());
    for (std::size_t c = 0; c < columns_; ++c)
      for (int l = 0; l < layers_; ++l)
        for (int k = 0; k < 3; ++k)
          air_[3 * solver_index(c, l) + k] = static_cast<T>(air[l * columns_ + c][k]);
    told.air = air_.data();
  }
  step_ = step;
  ++launches_;
  solver_->assemble(told);
}

template <class T>
std::vector<kernels::MeshContact<T>> Body<T>::contacts() const {
  std::vector<kernels::MeshContact<T>> contacts(positions_.size());
  contacts.resize(static_cast<std::size_t>(solver_->get_contacts(contacts.data())));
  return contacts;
}

template <class T>
void Body<T>::carry(std::span<const kernels::SolidView> solids,
                    const std::vector<kernels::MeshEllipsoid<T>>& ellipsoids, double step) {
  std::vector<kernels::MeshContact<T>> all = contacts();
  if (all.empty()) return;
  for (kernels::MeshContact<T>& contact : all) {
    const auto at = 3 * static_cast<std::size_t>(contact.vertex),
               solid = static_cast<std::size_t>(contact.solid);
    const Vec3 x(solver_positions_[at], solver_positions_[at + 1], solver_positions_[at + 2]);
    if (solid >= solids.size() + ellipsoids.size()) continue;  // of a checkpoint of other solids
    const Vec3 velocity = solid < solids.size()
                              ? carrying_velocity(solids[solid], origin_ + x, step)
                              : carrying_velocity(ellipsoids[solid - solids.size()], x, step);
    for (int k = 0; k < 3; ++k) contact.velocity[k] = static_cast<T>(velocity[k]);
  }
  solver_->set_contacts(all.data(), static_cast<std::int32_t>(all.size()));
}

template <class T>
void Body<T>::solve(FrameFigures& figures) {
  ++launches_;
  const kernels::SolveFigures took = solver_->solve();
  figures.solves += 1, figures.iterations += took.iterations;
  figures.residual = worse(figures.residual, took.residual);
  fetch();
}

template <class T>
void Body<T>::collide(std::span<const kernels::SolidView> solids,
                      const std::vector<kernels::MeshEllipsoid<T>>& ellipsoids, FrameFigures& figures) {
  kernels::MeshContactFigures all;  // each call tells of all so far
  for (const kernels::SolidView& solid : solids) {
    const SolidCollider<T> collider(solid, origin_, step_);
    ++launches_;
    all = solver_->collide(kernels::mesh_surface<T>(collider));
  }
  if (!ellipsoids.empty()) {
    ++launches_;
    all = solver_->collide(ellipsoids.data(), static_cast<std::int32_t>(ellipsoids.size()));
  }
  figures.touched = std::max(figures.touched, static_cast<double>(all.touched));
  figures.corrected = std::max(figures.corrected, static_cast<double>(all.corrected));
  figures.depth = std::max(figures.depth, all.depth);
  fetch();
}

template <class T>
void Body<T>::minimise(FrameFigures& figures) {
  ++launches_;
  const kernels::SolveFigures took = solver_->minimise();
  figures.minimisations += took.iterations > 0 ? 1 : 0;
  figures.minimise_iterations += took.iterations;
  figures.minimise_residual = worse(figures.minimise_residual, took.residual);
  fetch();
}

template <class T>
std::optional<MeshDivergence> Body<T>::diverged(const scene::Limits& limits) const {
  for (int l = 0; l < layers_; ++l)
    for (std::size_t c = 0; c < columns_; ++c) {
      const std::size_t v = l * columns_ + c;
      if (!positions_[v].allFinite() || !velocities_[v].allFinite())
        return MeshDivergence{c, l, "a value is not finite"};
      if (velocities_[v].norm() > limits.speed)
        return MeshDivergence{
            c, l, fmt::format("{:.3g} m/s, beyond the limit of {} m/s", velocities_[v].norm(), limits.speed)};
      if (l == 0) continue;
      const std::size_t below = v - columns_;
      const double strain = (positions_[v] - positions_[below]).norm() / (rest_[v] - rest_[below]).norm() - 1;
      if (strain > limits.edge_strain)
        return MeshDivergence{
            c, l, fmt::format("edge strain {:.3g}, beyond the limit of {}", strain, limits.edge_strain)};
    }
  return std::nullopt;
}

template <class T>
std::optional<MeshDivergence> Body<T>::bad_contact() const {
  for (const kernels::MeshContact<T>& contact : contacts()) {
    T sum = contact.friction;
    for (int c = 0; c < 3; ++c) sum += contact.normal[c] + contact.velocity[c] + contact.force[c];
    if (!std::isfinite(sum))
      return MeshDivergence{static_cast<std::size_t>(contact.vertex / layers_), contact.vertex % layers_,
                            "a value of its contact is not finite"};
  }
  return std::nullopt;
}

template <class T>
double Body<T>::strain() const {
  double most = 0;
  for (std::size_t v = columns_; v < positions_.size(); ++v)
    most = std::max(
        most,
        (positions_[v] - positions_[v - columns_]).norm() / (rest_[v] - rest_[v - columns_]).norm() - 1);
  return most;
}

template <class T>
double Body<T>::speed() const {
  double most = 0;
  for (const Vec3& v : velocities_) most = std::max(most, v.norm());
  return most;
}

template <class T>
std::size_t Body<T>::bytes() const {
  return solver_->bytes() +
         (rest_.size() + rest_roots_.size() + positions_.size() + velocities_.size()) * sizeof(Vec3) +
         (solver_positions_.size() + solver_velocities_.size() + roots_.size() + air_.size()) * sizeof(T);
}

template <class T>
std::size_t Body<T>::checkpoint_bytes(bool touches) const {
  return (solver_positions_.size() + solver_velocities_.size()) * sizeof(T) +
         (touches ? positions_.size() * sizeof(kernels::MeshContact<T>) : 0);
}

template <class T>
void Body<T>::save(state::Snapshot& snapshot, const std::string& suffix) const {
  snapshot.arrays["mesh_position" + suffix] = bytes_of(solver_positions_);
  snapshot.arrays["mesh_velocity" + suffix] = bytes_of(solver_velocities_);
  snapshot.arrays["mesh_contacts" + suffix] = bytes_of(contacts());
}

template <class T>
void Body<T>::restore(const state::Snapshot& snapshot, const std::string& suffix) {
  const auto take = [&](const char* name, std::vector<T>& into) {
    const auto& bytes = array_of(snapshot, name + suffix, sizeof(T), into.size());
    std::memcpy(into.data(), bytes.data(), bytes.size());
  };
  take("mesh_position", solver_positions_), take("mesh_velocity", solver_velocities_);
  const auto& bytes =
      array_of(snapshot, "mesh_contacts" + suffix, sizeof(kernels::MeshContact<T>), std::nullopt);
  std::vector<kernels::MeshContact<T>> contacts(bytes.size() / sizeof(kernels::MeshContact<T>));
  std::memcpy(contacts.data(), bytes.data(), bytes.size());
  for (const kernels::MeshContact<T>& contact : contacts)
    if (contact.vertex < 0 || static_cast<std::size_t>(contact.vertex) >= positions_.size())
      throw Error(ErrorKind::kInput, "state",
                  "`mesh_contacts" + suffix + "` names a vertex that is not there", "run without --resume");
  solver_->set_state(solver_positions_.data(), solver_velocities_.data());
  solver_->set_contacts(contacts.data(), static_cast<std::int32_t>(contacts.size()));
  fetch();
}

template <class T>
void Body<T>::fetch() {
  solver_->get_state(solver_positions_.data(), solver_velocities_.data());
  for (std::size_t c = 0; c < columns_; ++c)
    for (int l = 0; l < layers_; ++l)
      for (int k = 0; k < 3; ++k) {
        const std::size_t from = 3 * solver_index(c, l) + k, to = l * columns_ + c;
        positions_[to][k] = origin_[k] + static_cast<double>(solver_positions_[from]);
        velocities_[to][k] = static_cast<double>(solver_velocities_[from]);
      }
}

template <class T>
void Body<T>::hand_over() {
  for (std::size_t c = 0; c < columns_; ++c)
    for (int l = 0; l < layers_; ++l)
      for (int k = 0; k < 3; ++k) {
        const std::size_t to = 3 * solver_index(c, l) + k, from = l * columns_ + c;
        solver_positions_[to] = static_cast<T>(positions_[from][k] - origin_[k]);
        solver_velocities_[to] = static_cast<T>(velocities_[from][k]);
      }
  solver_->set_state(solver_positions_.data(), solver_velocities_.data());
}

template class Body<float>;
template class Body<double>;

}  // namespace ringlet::hairmesh
