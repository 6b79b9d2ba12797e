// A hair mesh's simulation as the program calls it, whatever it was compiled for.
#pragma once
#include <cstddef>
#include <cstdint>

#include "kernels/hairmesh/hair_mesh_elements.h"

namespace ringlet::kernels {

// The place of a solid's surface that a vertex is told of.
template <class T>
struct MeshSurfacePoint {
  T point[3];     // on the surface, where the vertex has to be [m]
  T normal[3];    // out of the solid, of length 1
  T velocity[3];  // of the surface there [m/s]
  T friction;     // Coulomb mu [-]
};

// What hair mesh vertices collide with. `find` says whether a vertex that the step has brought from `before`
// to `point` lies deeper than `reach` above the surface (0: inside; negative: so deep inside), or has gone
// through the solid; it then fills `found`, with what is nearest the point, or nearest where the vertex
// slides to from where it entered. Called for one vertex after another.
template <class T>
struct MeshSurface {
  const void* context;
  bool (*find)(const void* context, const T* before, const T* point, T reach, MeshSurfacePoint<T>& found);
};

// Any callable bool(const T* before, const T* point, T reach, MeshSurfacePoint<T>& found), which has to
// outlive the surface.
template <class T, class Find>
MeshSurface<T> mesh_surface(const Find& find) {
  return {&find,
          [](const void* context, const T* before, const T* point, T reach, MeshSurfacePoint<T>& found) {
            return (*static_cast<const Find*>(context))(before, point, reach, found);
          }};
}

// An ellipsoid that moves rigidly.
template <class T>
struct MeshEllipsoid {
  T centre[3];    // [m]
  T axis[3][3];   // its axes' directions, orthonormal
  T radius[3];    // along them [m]
  T velocity[3];  // of the centre [m/s]
  T spin[3];      // angular velocity [rad/s]
  T turn[3];      // by the step, as the vector part of a unit quaternion, its real part not negative
  T friction;     // Coulomb mu [-]
};

// A vertex in contact: until the next step's end its surface holds it along the normal, or wholly where it
// sticks.
template <class T>
struct MeshContact {
  std::int32_t vertex;
  std::int32_t solid;   // whose, by the order in which `collide` is told of them
  std::int32_t sticks;  // 1: friction holds it
  T normal[3];
  T velocity[3];  // of the surface there [m/s]
  T force[3];     // of friction on one that slides, from the last step's push [N]
  T friction;     // Coulomb mu [-]
};

// What acts during a step.
template <class T>
struct HairMeshStep {
  T step;  // h [s]
  const T*
      roots;  // [columns][3] where the head takes them by the step's end [m]; not read where none are held
  T rotation[9];  // the head's since rest, row by row: where hair of no length points
  T gravity[3];   // [m/s^2]
  const T* air;   // [vertices][3] the air's velocity [m/s]; null: still air
};

// Since the last `solve`.
struct MeshContactFigures {
  std::int32_t touched = 0;    // vertices in contact with a solid
  std::int32_t corrected = 0;  // those moved out of one
  double depth = 0;            // of the deepest [m]
};

// [J]
struct MeshEnergies {
  double stretch = 0, horizontal = 0, sheets = 0, bend = 0, volume = 0, kinetic = 0;
};

// A frame is `assemble`, `solve`, `collide` for what there is to collide with, `minimise`; each can be timed.
// Shorter steps are the caller's, with roots on the way. Arrays are [vertices][3], numbered as by
// HairMeshTopology.
template <class T>
class HairMeshSolver {
 public:
  virtual ~HairMeshSolver();
  // Also forgets contacts.
  virtual void set_state(const T* position, const T* velocity) = 0;
  virtual void get_state(T* position, T* velocity) const = 0;
  // Forces and the system of a step from the state as it is.
  virtual void assemble(const HairMeshStep<T>& step) = 0;
  // Solves the system and moves the mesh: roots to where they are taken, vertices in contact as their surface
  // does along its normal.
  virtual SolveFigures solve() = 0;
  // Moves external vertices out of a solid, or back to where they entered one that they went through, and
  // answers their velocities; moves outer faces and edges that are cut by it as a whole; they are in contact
  // until the next `solve`. Solids are told of in the same order in every step.
  virtual MeshContactFigures collide(const MeshSurface<T>& surface) = 0;
  virtual MeshContactFigures collide(const MeshEllipsoid<T>* ellipsoids, std::int32_t count) = 0;
  // Takes the rest of the mesh along with what was corrected since this was last called, once a frame:
  // velocities change by the displacement over the time that has gone since. Each step of many would turn
  // corrections however small into speeds.
  virtual SolveFigures minimise() = 0;
  // What is in contact, to go on from there another time. `contacts` has room for all vertices.
  virtual std::int32_t get_contacts(MeshContact<T>* contacts) const = 0;
  virtual void set_contacts(const MeshContact<T>* contacts, std::int32_t count) = 0;
  virtual MeshEnergies energies() const = 0;
  // Signed, enclosed by the outer surface [m^3].
  virtual double volume() const = 0;
  virtual std::size_t bytes() const = 0;
};

}  // namespace ringlet::kernels
