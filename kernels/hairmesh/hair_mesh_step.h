// One step of a hair mesh: implicit Euler with prescribed roots and contacts (Baraff and Witkin 1998,
// sections 3 and 5), collisions of external vertices, and the rest of the mesh taken along (hair mesh
// paper, 3.2).
#pragma once
#include <limits>

#include "kernels/hairmesh/deformation_minimisation.h"
#include "kernels/hairmesh/filtered_conjugate_gradients.h"
#include "kernels/hairmesh/hair_mesh_contact.h"
#include "kernels/hairmesh/hair_mesh_forces.h"
#include "kernels/hairmesh/hair_mesh_solver.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

template <class E>
class MeshElements {
 public:
  explicit MeshElements(MeshArray<E> elements) {
    copy_values(buffer_, elements.data, static_cast<std::size_t>(elements.count));
  }
  const E* begin() const { return buffer_.data(); }
  const E* end() const { return buffer_.data() + buffer_.size(); }
  std::size_t bytes() const { return buffer_.bytes(); }

 private:
  HostBuffer<E> buffer_;
};

template <class T>
class MeshStepper final : public HairMeshSolver<T> {
 public:
  explicit MeshStepper(const HairMeshView<T>& mesh)
      : columns_(mesh.columns),
        layers_(mesh.layers),
        vertices_(mesh.columns * mesh.layers),
        extrusion_springs_(mesh.extrusion_springs),
        held_roots_(mesh.held_roots),
        damping_(mesh.damping),
        drag_(mesh.drag),
        tolerance_(mesh.tolerance),
        reach_(mesh.reach),
        iterations_(mesh.iterations),
        springs_(mesh.springs),
        sheets_(mesh.sheets),
        bends_(mesh.bends),
        volumes_(mesh.volumes),
        external_(mesh.external),
        samples_(mesh.samples),
        surface_({mesh.surface.data, 4 * mesh.surface.count}),
        lanes_(columns_, layers_, mesh.pattern.first_layer, mesh.pattern.pairs),
        matrix_(mesh.pattern, lanes_),
        laplacian_(lanes_, mesh.degree, mesh.first_neighbour, mesh.neighbour),
        filter_(columns_, layers_),
        gradients_(lanes_) {
    const auto count = static_cast<std::size_t>(vertices_);
    copy_values(mass_, mesh.mass, count);
    zero_values(4 * count, position_, velocity_, impulse_, change_, displacement_, rubbing_, carried_,
                before_);
    zero_values(count, held_), zero_values(count, holder_), zero_values(count, moved_in_);
    zero_values(count, contact_of_);
    roots_.resize(4 * static_cast<std::size_t>(columns_));
    contacts_.resize(count), corrected_.resize(count), turned_.resize(count);
    for (std::int32_t v = 0; v < vertices_; ++v) position()[v] = padded(mesh.rest + 3 * v);
  }

  void set_state(const T* x, const T* v) override {
    for (std::int32_t i = 0; i < vertices_; ++i)
      position()[i] = padded(x + 3 * i), velocity()[i] = padded(v + 3 * i);
    for (std::int32_t i = 0; i < vertices_; ++i) vectors(before_)[i] = position()[i];
    forget_contacts(), release_all(), forget_corrections();
  }
  void get_state(T* x, T* v) const override {
    for (std::int32_t i = 0; i < vertices_; ++i)
      store_three(x + 3 * i, position()[i]), store_three(v + 3 * i, velocity()[i]);
  }

  void assemble(const HairMeshStep<T>& step) override {
    const T h = step.step;
    step_ = h;
    prescribe(step.roots);
    StepSystem<T> system{step_factors(h, damping_), position(),      velocity(),
                         vectors(impulse_),         matrix_.clear(), {}};
    for (int k = 0; k < 3; ++k)
      system.turn[k] = Padded<T>{step.rotation[k], step.rotation[3 + k], step.rotation[6 + k], 0};
    const Padded<T> gravity = padded(step.gravity);
    for (std::int32_t i = 0; i < vertices_; ++i) {
      const T mass = mass_.data()[i];
      const Padded<T> air = step.air != nullptr ? padded(step.air + 3 * i) : Padded<T>{};
      vectors(impulse_)[i] = (h * mass) * (gravity + drag_ * (air - velocity()[i]));
      matrix_.add_to_diagonal(i, mass * (T(1) + h * drag_));
    }
    for (std::int32_t k = 0; k < contact_count_; ++k)
      vectors(impulse_)[contacts_.data()[k].vertex] += h * padded(contacts_.data()[k].force);
    for (const MeshSpring<T>& e : springs_) add_to<T>(system, e);
    for (const MeshSheet<T>& e : sheets_) add_to<T>(system, e);
    for (const MeshBend<T>& e : bends_) add_to<T>(system, e);
    for (const MeshVolume<T>& e : volumes_) add_to<T>(system, e);
    matrix_.finish();
  }

  SolveFigures solve() override {
    hold();
    SolveFigures figures =
        gradients_.solve(matrix_, filter_, tolerance_, iterations_, vectors(impulse_), vectors(change_));
    for (int round = 0; round < kMostRounds && stop_turned(); ++round) {
      const SolveFigures more =
          gradients_.solve_on(matrix_, filter_, tolerance_, iterations_ - figures.iterations,
                              vectors(impulse_), vectors(change_));
      figures.iterations += more.iterations;
      if (!(more.residual <= figures.residual)) figures.residual = more.residual;
    }
    for (std::int32_t i = 0; i < vertices_; ++i) velocity()[i] += vectors(change_)[i];
    release_all();
    for (std::int32_t k = 0; k < contact_count_; ++k) rub(contacts_.data()[k], vectors(carried_)[k]);
    for (std::int32_t i = 0; i < vertices_; ++i) {
      vectors(before_)[i] = position()[i];
      position()[i] += step_ * velocity()[i];
    }
    if (held_roots_)  // to the last bit
      for (std::int32_t c = 0; c < columns_; ++c) position()[c * layers_] = vectors(roots_)[c];
    forget_contacts();
    elapsed_ += step_, ++steps_;
    solids_met_ = moved_count_ = 0, depth_ = 0;
    return figures;
  }

  MeshContactFigures collide(const MeshSurface<T>& surface) override {
    collide_with(
        [&](const T* before, const T* point, T reach, MeshSurfacePoint<T>& found) {
          return surface.find(surface.context, before, point, reach, found);
        },
        T(0));
    return contact_figures();
  }
  MeshContactFigures collide(const MeshEllipsoid<T>* ellipsoids, std::int32_t count) override {
    for (std::int32_t k = 0; k < count; ++k) {
      const T* radius = ellipsoids[k].radius;
      collide_with(
          [&](const T* before, const T* point, T reach, MeshSurfacePoint<T>& found) {
            return find_on_ellipsoid(ellipsoids[k], before, point, reach, static_cast<double>(step_), found);
          },
          min(radius[0], min(radius[1], radius[2])));
    }
    return contact_figures();
  }

  SolveFigures minimise() override {
    if (corrected_count_ == 0) {
      elapsed_ = T(0);
      return {};
    }
    filter_.clear();
    for (std::int32_t k = 0; k < corrected_count_; ++k) filter_.prescribe_wholly(corrected_.data()[k]);
    // What touches without having been moved stays where it is as well.
    for (std::int32_t k = 0; k < contact_count_; ++k)
      if (filter_.is_free(contacts_.data()[k].vertex)) filter_.prescribe_wholly(contacts_.data()[k].vertex);
    laplacian_.factor(filter_);
    // From what the correction alone leaves; beside it the solve finds what the others do.
    Padded<T>*u = vectors(displacement_), *left = vectors(impulse_), *w = vectors(change_);
    gradients_.multiply(laplacian_, u, left);
    for (std::int32_t i = 0; i < vertices_; ++i) left[i] = -left[i];
    const SolveFigures figures = gradients_.solve(laplacian_, filter_, tolerance_, iterations_, left, w);
    const T per_time = T(1) / elapsed_;
    for (std::int32_t i = 0; i < vertices_; ++i) position()[i] += w[i], velocity()[i] += per_time * w[i];
    forget_corrections();
    return figures;
  }

  std::int32_t get_contacts(MeshContact<T>* contacts) const override {
    for (std::int32_t k = 0; k < contact_count_; ++k) contacts[k] = contacts_.data()[k];
    return contact_count_;
  }
  void set_contacts(const MeshContact<T>* contacts, std::int32_t count) override {
    forget_contacts(), release_all();
    for (std::int32_t k = 0; k < count; ++k) keep(contacts[k]);
  }

  MeshEnergies energies() const override {
    MeshEnergies sums;
    std::int32_t k = 0;
    for (const MeshSpring<T>& e : springs_)
      (k++ < extrusion_springs_ ? sums.stretch : sums.horizontal) += energy<T>(e, position());
    for (const MeshSheet<T>& e : sheets_) sums.sheets += energy<T>(e, position());
    for (const MeshBend<T>& e : bends_) sums.bend += energy<T>(e, position());
    for (const MeshVolume<T>& e : volumes_) sums.volume += energy<T>(e, position());
    for (std::int32_t i = 0; i < vertices_; ++i)
      sums.kinetic += 0.5 * mass_.data()[i] * dot_product(velocity()[i], velocity()[i]);
    return sums;
  }

  // Faces of four vertices are cut along one diagonal and the other, and the mean is taken.
  double volume() const override {
    double sixfold = 0;
    for (const std::int32_t* face = surface_.begin(); face != surface_.end(); face += 4) {
      if (face[3] < 0) {
        sixfold += sixfold_volume(face[0], face[1], face[2]);
        continue;
      }
      sixfold +=
          0.5 * (sixfold_volume(face[0], face[1], face[2]) + sixfold_volume(face[0], face[2], face[3]) +
                 sixfold_volume(face[1], face[2], face[3]) + sixfold_volume(face[1], face[3], face[0]));
    }
    return sixfold / 6;
  }

  std::size_t bytes() const override {
    const std::size_t total = lanes_.bytes() + matrix_.bytes() + laplacian_.bytes() + gradients_.bytes() +
                              springs_.bytes() + sheets_.bytes() + bends_.bytes() + volumes_.bytes() +
                              external_.bytes() + samples_.bytes() + surface_.bytes();
    return total + mass_.bytes() + 8 * position_.bytes() + roots_.bytes() + filter_.bytes() +
           corrected_.bytes() + turned_.bytes() + held_.bytes() + holder_.bytes() + moved_in_.bytes() +
           contact_of_.bytes() + contacts_.bytes();
  }

  // y = A x
  void multiply(const Padded<T>* x, Padded<T>* y) { gradients_.multiply(matrix_, x, y); }
  const Padded<T>* impulse() const { return vectors(impulse_); }
  const Padded<T>* change() const { return vectors(change_); }

 private:
  // kReleased: its surface had to hold it back in this step, which no surface does.
  static constexpr int kMostRounds = 8;
  enum Held : char { kFree, kSlides, kSticks, kReleased };

  static Padded<T>* vectors(const HostBuffer<T>& buffer) {
    return reinterpret_cast<Padded<T>*>(buffer.data());
  }
  Padded<T>* position() const { return vectors(position_); }
  Padded<T>* velocity() const { return vectors(velocity_); }

  // From the mesh's first vertex: far from the origin the terms would cancel.
  double sixfold_volume(std::int32_t a, std::int32_t b, std::int32_t c) const {
    const auto from = [&](std::int32_t v) {
      Padded<double> d{};
      for (int k = 0; k < 3; ++k) d[k] = double(position()[v][k]) - double(position()[0][k]);
      return d;
    };
    return dot_product(from(a), cross_product(from(b), from(c)));
  }

  // Gives roots, and vertices in contact along their normals, the velocities that they have to have at the
  // step's end (Baraff and Witkin's z): elements then see them, and the solve has to keep what is so
  // prescribed.
  void prescribe(const T* roots) {
    const T per_step = T(1) / step_;
    if (held_roots_)
      for (std::int32_t c = 0; c < columns_; ++c) {
        vectors(roots_)[c] = padded(roots + 3 * c);
        velocity()[c * layers_] = per_step * (vectors(roots_)[c] - position()[c * layers_]);
      }
    for (std::int32_t k = 0; k < contact_count_; ++k) {
      const MeshContact<T>& contact = contacts_.data()[k];
      const Padded<T> n = padded(contact.normal);
      Padded<T> change = padded(contact.velocity) - velocity()[contact.vertex];
      if (!contact.sticks) change = dot_product(n, change) * n;
      velocity()[contact.vertex] += change;
      vectors(carried_)[k] = mass_.data()[contact.vertex] * change;
    }
  }

  // Prescribes what contacts hold.
  void hold() {
    filter_.clear();
    for (std::int32_t k = 0; k < contact_count_; ++k) {
      const MeshContact<T>& contact = contacts_.data()[k];
      if (contact.sticks)
        filter_.prescribe_wholly(contact.vertex);
      else
        filter_.prescribe_along(contact.vertex, padded(contact.normal));
    }
    matrix_.factor(filter_);
  }

  // What slides is stopped where friction would turn its motion: it sticks from the step's start, and the
  // solve is to go on with the rest. Stopped after the solve it would leave the rest where hair that slid on
  // would have taken it, which then jerks at what sticks, and hair that chatters so never comes to rest.
  bool stop_turned() {
    std::int32_t* turned = turned_.data();
    std::int32_t count = 0;
    for (std::int32_t k = 0; k < contact_count_; ++k) {
      const MeshContact<T>& contact = contacts_.data()[k];
      if (contact.sticks) continue;
      const Padded<T> relative =
          velocity()[contact.vertex] + vectors(change_)[contact.vertex] - padded(contact.velocity);
      if (turns(relative, contact)) turned[count++] = k;
    }
    for (std::int32_t k = 0; k < count; ++k) {
      MeshContact<T>& contact = contacts_.data()[turned[k]];
      contact.sticks = 1;
      filter_.prescribe_wholly(contact.vertex);
      vectors(change_)[contact.vertex] = padded(contact.velocity) - velocity()[contact.vertex];
      vectors(impulse_)[contact.vertex] -= step_ * padded(contact.force);
    }
    std::int32_t last = -1;
    for (std::int32_t k = 0; k < count; ++k) {
      const std::int32_t column = contacts_.data()[turned[k]].vertex / layers_;
      if (column != last) matrix_.factor_column(column, filter_);
      last = column;
    }
    return count > 0;
  }

  // What holding a vertex took, as an impulse, with that of `prescribe`. One that had to be held back, which
  // no surface does, is let go. One that sticks slides when that took more than Coulomb's cone allows, and
  // from then on has the cone's force against its motion; until the force would turn its motion, when it
  // sticks.
  void rub(const MeshContact<T>& contact, Padded<T> carried) {
    const std::int32_t i = contact.vertex;
    const Padded<T> n = padded(contact.normal),
                    held = carried + (gradients_.product(i) - vectors(impulse_)[i]);
    const T push = dot_product(n, held);
    held_.data()[i] = kReleased, holder_.data()[i] = contact.solid;
    if (!(push > T(0))) return;
    Padded<T> direction;  // of friction
    if (contact.sticks) {
      direction = held - push * n;
      held_.data()[i] =
          square(direction) <= contact.friction * contact.friction * push * push ? kSticks : kSlides;
    } else {
      const Padded<T> relative = velocity()[i] - padded(contact.velocity);
      direction = dot_product(n, relative) * n - relative;
      held_.data()[i] = stops(i, relative, contact) ? kSticks : kSlides;
      if (held_.data()[i] == kSticks) velocity()[i] += direction;
    }
    const T size = sqrt(square(direction));
    const T scale =
        held_.data()[i] == kSlides && size > T(0) ? contact.friction * push / (size * step_) : T(0);
    vectors(rubbing_)[i] = scale * direction;
  }
  static RINGLET_KERNEL bool turns(Padded<T> relative, const MeshContact<T>& contact) {
    return dot_product(relative, padded(contact.force)) > T(0);
  }
  // What moves less in a step than rounding does has no direction for friction to act against.
  RINGLET_KERNEL bool stops(std::int32_t i, Padded<T> relative, const MeshContact<T>& contact) const {
    constexpr T kRounding = std::numeric_limits<T>::epsilon();
    return turns(relative, contact) ||
           (contact.friction > T(0) &&
            step_ * step_ * square(relative) <= kRounding * kRounding * square(position()[i]));
  }
  static RINGLET_KERNEL T square(Padded<T> a) { return dot_product(a, a); }

  // A surface holds what it held, as far as it reaches. What is nowhere nearer to its middle than `radius`
  // cannot get in between vertices that are nearer to each other.
  template <class Find>
  void collide_with(const Find& find, T radius) {
    const std::int32_t solid = solids_met_++;
    for (const std::int32_t i : external_) {
      MeshSurfacePoint<T> found;
      T before[3], point[3];
      store_three(before, vectors(before_)[i]), store_three(point, position()[i]);
      if (!find(before, point, held_by(i, solid) ? reach_ : T(0), found)) continue;
      const Padded<T> n = padded(found.normal), out = padded(found.point) - position()[i];
      const T depth = dot_product(n, out);
      if (depth > T(0)) {
        depth_ = max(depth_, static_cast<double>(depth));
        correct(i, out);
      } else if (contact_of_.data()[i] != 0) {
        continue;  // another holds it in this step
      }
      touch(i, solid, found);
    }
    for (const MeshSample<T>& sample : samples_)
      if (sample.span > radius) collide_between(find, solid, sample);
  }
  bool held_by(std::int32_t i, std::int32_t solid) const {
    return (held_.data()[i] == kSlides || held_.data()[i] == kSticks) && holder_.data()[i] == solid;
  }

  // A sample that is deeper in a solid than chords of what is round are takes its vertices along, and the
  // solid holds them as it does those that it touches itself.
  template <class Find>
  void collide_between(const Find& find, std::int32_t solid, const MeshSample<T>& sample) {
    Padded<T> from{}, at{};
    std::int32_t count = 0;
    bool held = false;
    while (count < 4 && sample.vertex[count] >= 0) {
      const std::int32_t i = sample.vertex[count++];
      from += vectors(before_)[i], at += position()[i];
      held = held || held_by(i, solid);
    }
    const T share = T(1) / static_cast<T>(count), slack = T(0.15) * sample.span;
    MeshSurfacePoint<T> found;
    T before[3], point[3];
    store_three(before, share * from), store_three(point, share * at);
    if (!find(before, point, held ? reach_ - slack : -slack, found)) return;
    const Padded<T> n = padded(found.normal), out = padded(found.point) - slack * n - padded(point);
    const T depth = dot_product(n, out);
    if (depth > T(0)) depth_ = max(depth_, static_cast<double>(depth));
    for (std::int32_t k = 0; k < count; ++k) {
      if (depth > T(0)) correct(sample.vertex[k], out);
      if (contact_of_.data()[sample.vertex[k]] == 0) touch(sample.vertex[k], solid, found);
    }
  }

  void touch(std::int32_t i, std::int32_t solid, const MeshSurfacePoint<T>& found) {
    const Padded<T> n = padded(found.normal);
    // One that was let go comes anew only where it moves into the surface: rounding may leave it inside.
    if (held_.data()[i] == kReleased && !(dot_product(velocity()[i] - padded(found.velocity), n) < T(0)))
      return;
    velocity()[i] = velocity_after_contact<T>(velocity()[i], padded(found.velocity), n, found.friction);
    hold(i, solid, found);
  }
  MeshContactFigures contact_figures() const { return {contact_count_, moved_count_, depth_}; }

  void correct(std::int32_t i, Padded<T> out) {
    Padded<T>& u = vectors(displacement_)[i];
    const bool first = u[0] == 0 && u[1] == 0 && u[2] == 0;
    if (first) corrected_.data()[corrected_count_++] = i;
    position()[i] += out, u += out;
    if (moved_in_.data()[i] == steps_) return;
    moved_in_.data()[i] = steps_, ++moved_count_;
  }
  void forget_corrections() {
    for (std::int32_t k = 0; k < corrected_count_; ++k)
      vectors(displacement_)[corrected_.data()[k]] = Padded<T>{};
    corrected_count_ = 0, elapsed_ = T(0);
  }

  // The last surface that a vertex meets holds it.
  void hold(std::int32_t i, std::int32_t solid, const MeshSurfacePoint<T>& found) {
    const bool known = holder_.data()[i] == solid, slides = known && held_.data()[i] == kSlides,
               sticks = known && held_.data()[i] == kSticks;
    MeshContact<T> contact{i, solid, sticks, {}, {}, {}, found.friction};
    for (int c = 0; c < 3; ++c) contact.normal[c] = found.normal[c], contact.velocity[c] = found.velocity[c];
    if (slides) store_three(contact.force, vectors(rubbing_)[i]);
    if (!slides && !sticks)  // whether friction stopped it
      contact.sticks = found.friction > T(0) && square(velocity()[i] - padded(found.velocity)) == T(0);
    keep(contact);
  }
  void keep(const MeshContact<T>& contact) {
    std::int32_t& place = contact_of_.data()[contact.vertex];
    if (place == 0) place = ++contact_count_;
    contacts_.data()[place - 1] = contact;
  }
  void forget_contacts() {
    for (std::int32_t k = 0; k < contact_count_; ++k) contact_of_.data()[contacts_.data()[k].vertex] = 0;
    contact_count_ = 0;
  }
  void release_all() {
    for (std::int32_t i = 0; i < vertices_; ++i) held_.data()[i] = kFree;
  }

  std::int32_t columns_, layers_, vertices_, extrusion_springs_;
  bool held_roots_;
  T damping_, drag_, tolerance_, reach_, step_ = T(1);
  std::int32_t iterations_;
  MeshElements<MeshSpring<T>> springs_;
  MeshElements<MeshSheet<T>> sheets_;
  MeshElements<MeshBend<T>> bends_;
  MeshElements<MeshVolume<T>> volumes_;
  MeshElements<std::int32_t> external_;
  MeshElements<MeshSample<T>> samples_;
  MeshElements<std::int32_t> surface_;
  PairLanes<T> lanes_;
  BlockMatrix<T> matrix_;
  MeshLaplacian<T> laplacian_;
  VertexFilter<T> filter_;
  FilteredConjugateGradients<T> gradients_;
  HostBuffer<T> mass_, position_, velocity_, impulse_, change_, displacement_, before_, roots_;
  HostBuffer<std::int32_t> turned_;      // in contacts_: those that friction stopped in this solve
  HostBuffer<std::int32_t> corrected_;   // since they were last minimised
  HostBuffer<std::int32_t> moved_in_;    // [vertices] the last step that did so
  HostBuffer<std::int32_t> contact_of_;  // [vertices] place in contacts_ plus 1; 0: none
  HostBuffer<char> held_;                // how a surface that pushed it held a vertex in the last solve
  HostBuffer<std::int32_t> holder_;      // which
  HostBuffer<MeshContact<T>> contacts_;
  HostBuffer<T> carried_;  // impulses that gave contacts their surface's velocity [N s]
  HostBuffer<T> rubbing_;  // [vertices] friction on those that slide [N]
  // Steps taken, from 1, and of this one: solids that were told of, vertices that were moved.
  std::int32_t steps_ = 1, solids_met_ = 0, moved_count_ = 0;
  std::int32_t contact_count_ = 0, corrected_count_ = 0;
  T elapsed_ = T(0);  // since corrections were last minimised [s]
  double depth_ = 0;  // of the deepest correction since the last solve [m]
};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
