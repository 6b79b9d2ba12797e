// Energies of a hair mesh's elements, their forces, and what they add to the system of a step (Baraff and
// Witkin 1998; the volume: hair mesh paper, equations 1 and 2).
//
// With energy E = (k/2) C^T C, J = dC/dx and damping of the conditions' rates, an element's force is
//   f = -J^T (k C + k tau J v),
// exactly the gradient of its energy beside the damping. One step of implicit Euler, (M - h df/dv - h^2
// df/dx) dv = h (f + h df/dx v), gets from it the positive semidefinite matrix and the right-hand side
//   (h^2 + h tau) k J^T J   and   -J^T (h k C + (h^2 + h tau) k J v).
// What else the second derivative of E holds, k C d^2C/dx^2, may be indefinite and is left out; but for the
// tension of stretched springs, k (1 - 1/|w|) (I - w w^T / w^2), which is semidefinite and keeps hanging hair
// from swinging past.
#pragma once
#include "kernels/hairmesh/block_matrix.h"
#include "kernels/hairmesh/hair_mesh_elements.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

// By which the parts of an element go into the system: `spring` times k C, `rate` times k J v, and the
// tension.
template <class T>
struct StepFactors {
  T spring;   // h
  T rate;     // h^2 + h tau
  T tension;  // h^2
};
template <class T>
RINGLET_FUNCTION StepFactors<T> step_factors(T h, T tau) {
  return {h, h * (h + tau), h * h};
}

// The system that elements add to.
template <class T>
struct StepSystem {
  StepFactors<T> factors;
  const Padded<T>* position;
  const Padded<T>* velocity;
  Padded<T>* impulse;  // the right-hand side
  BlockSlots<T> matrix;
  Padded<T> turn[3];  // columns of the rotation that the head has made since rest
};

template <class T>
RINGLET_KERNEL Padded<T> turned(const Padded<T> (&turn)[3], const T* direction) {
  return turn[0] * (direction[0] - Padded<T>{}) + turn[1] * (direction[1] - Padded<T>{}) +
         turn[2] * (direction[2] - Padded<T>{});
}

// A stretch condition |w| - 1: length and direction of w. The energy has a kink at w = 0, where any direction
// is one of its (sub)gradients; hair of no length takes that which it has at rest, turned as the head has
// turned, so that a mesh that was put onto its roots grows back the way it grew.
template <class T>
struct Stretch {
  T length;
  Padded<T> direction;
};
template <class T>
RINGLET_KERNEL Stretch<T> stretch_of(Padded<T> w, const Padded<T> (&turn)[3], const T* rest_direction) {
  const T square = dot_product(w, w);
  const T shortest = T(1e-4);  // of rest
  if (!(square > shortest * shortest)) return {T(0), turned<T>(turn, rest_direction)};
  const T length = sqrt(square);
  return {length, (T(1) / length) * w};
}

// Block of (dw/dx)^T (rate w w^T + tension (1 - 1/|w|) (I - w w^T)) (dw/dx), by columns, before its
// coefficients.
template <class T>
RINGLET_KERNEL void stretch_block(const StepFactors<T>& factors, T stiffness, const Stretch<T>& w,
                                  Padded<T> (&columns)[3]) {
  const T across = w.length > T(1) ? factors.tension * stiffness * (T(1) - T(1) / w.length) : T(0);
  const Padded<T> along = (factors.rate * stiffness - across) * w.direction;
  columns[0] = along * spread_component<0>(w.direction) + Padded<T>{across, 0, 0, 0};
  columns[1] = along * spread_component<1>(w.direction) + Padded<T>{0, across, 0, 0};
  columns[2] = along * spread_component<2>(w.direction) + Padded<T>{0, 0, across, 0};
}
// What the right-hand side loses for a condition |w| - 1, over dw/dx.
template <class T>
RINGLET_KERNEL Padded<T> stretch_impulse(const StepFactors<T>& factors, T stiffness, const Stretch<T>& w,
                                         Padded<T> rate, const Padded<T> (&block)[3]) {
  return (factors.spring * stiffness * (w.length - T(1))) * w.direction +
         block[0] * spread_component<0>(rate) + block[1] * spread_component<1>(rate) +
         block[2] * spread_component<2>(rate);
}

template <class T>
RINGLET_KERNEL T energy(const MeshSpring<T>& e, const Padded<T>* x) {
  const Padded<T> w = e.inverse_length * (x[e.vertex[1]] - x[e.vertex[0]]);
  const T c = sqrt(dot_product(w, w)) - T(1);
  return T(0.5) * e.stiffness * c * c;
}
template <class T>
RINGLET_KERNEL void add_to(const StepSystem<T>& system, const MeshSpring<T>& e) {
  const std::int32_t a = e.vertex[0], b = e.vertex[1];
  const Padded<T> w = e.inverse_length * (system.position[b] - system.position[a]);
  const Padded<T> rate = e.inverse_length * (system.velocity[b] - system.velocity[a]);
  const Stretch<T> stretch = stretch_of<T>(w, system.turn, e.direction);
  Padded<T> block[3];
  stretch_block<T>(system.factors, e.stiffness, stretch, block);
  const Padded<T> impulse =
      e.inverse_length * stretch_impulse<T>(system.factors, e.stiffness, stretch, rate, block);
  system.impulse[a] += impulse, system.impulse[b] -= impulse;
  const T square = e.inverse_length * e.inverse_length;
  const Padded<T> p = square * block[0], q = square * block[1], r = square * block[2];
  system.matrix.add(e.slot[0], p, q, r), system.matrix.add(e.slot[1], p, q, r);
  system.matrix.add(e.slot[2], -p, -q, -r);
}

template <class T>
RINGLET_KERNEL Padded<T> weighted_sum(const T (&weight)[3], const std::int32_t (&v)[3], const Padded<T>* a) {
  return weight[0] * a[v[0]] + weight[1] * a[v[1]] + weight[2] * a[v[2]];
}
template <class T>
RINGLET_KERNEL Padded<T> weighted_sum(const T (&weight)[4], const std::int32_t (&v)[4], const Padded<T>* a) {
  return weight[0] * a[v[0]] + weight[1] * a[v[1]] + (weight[2] * a[v[2]] + weight[3] * a[v[3]]);
}

template <class T>
RINGLET_KERNEL T energy(const MeshSheet<T>& e, const Padded<T>* x) {
  const Padded<T> wu = weighted_sum(e.u, e.vertex, x), wv = weighted_sum(e.v, e.vertex, x);
  const T across = sqrt(dot_product(wv, wv)) - T(1), shear = dot_product(wu, wv);
  return T(0.5) * (e.across * across * across + e.shear * shear * shear);
}
template <class T>
RINGLET_KERNEL void add_to(const StepSystem<T>& system, const MeshSheet<T>& e) {
  const Padded<T> wu = weighted_sum(e.u, e.vertex, system.position),
                  wv = weighted_sum(e.v, e.vertex, system.position),
                  u_rate = weighted_sum(e.u, e.vertex, system.velocity),
                  v_rate = weighted_sum(e.v, e.vertex, system.velocity);
  const Stretch<T> stretch = stretch_of<T>(wv, system.turn, e.direction);
  Padded<T> block[3];
  stretch_block<T>(system.factors, e.across, stretch, block);
  const Padded<T> across = stretch_impulse<T>(system.factors, e.across, stretch, v_rate, block);
  Padded<T> gradient[3];  // of the shear condition
  for (int i = 0; i < 3; ++i) gradient[i] = e.u[i] * wv + e.v[i] * wu;
  const T shear_rate = dot_product(u_rate, wv) + dot_product(wu, v_rate);
  const T shear = e.shear * (system.factors.spring * dot_product(wu, wv) + system.factors.rate * shear_rate);
  for (int i = 0; i < 3; ++i) system.impulse[e.vertex[i]] -= e.v[i] * across + shear * gradient[i];
  const T k = system.factors.rate * e.shear;
  const auto add = [&](std::int32_t slot, int i, int j) {
    const T c = e.v[i] * e.v[j];
    const Padded<T> g = k * gradient[i], other = gradient[j];
    system.matrix.add(slot, c * block[0] + g * spread_component<0>(other),
                      c * block[1] + g * spread_component<1>(other),
                      c * block[2] + g * spread_component<2>(other));
  };
  add(e.slot[0], 0, 0), add(e.slot[1], 1, 1), add(e.slot[2], 2, 2);
  add(e.slot[3], 0, 1), add(e.slot[4], 0, 2), add(e.slot[5], 1, 2);
}

template <class T>
RINGLET_KERNEL T energy(const MeshBend<T>& e, const Padded<T>* x) {
  const Padded<T> before = weighted_sum(e.before, e.vertex, x), beside = weighted_sum(e.beside, e.vertex, x);
  const Padded<T> c = weighted_sum(e.own, e.vertex, x) - e.turn * cross_product(before, beside);
  return T(0.5) * e.stiffness * dot_product(c, c);
}
// J_i = own_i I + [y_i]x with y_i = turn (before_i t - beside_i p) and [y]x z = y x z.
template <class T>
RINGLET_KERNEL void add_to(const StepSystem<T>& system, const MeshBend<T>& e) {
  const Padded<T>*x = system.position, *v = system.velocity;
  const Padded<T> p = weighted_sum(e.before, e.vertex, x), t = weighted_sum(e.beside, e.vertex, x);
  const Padded<T> condition = weighted_sum(e.own, e.vertex, x) - e.turn * cross_product(p, t);
  const Padded<T> p_rate = weighted_sum(e.before, e.vertex, v), t_rate = weighted_sum(e.beside, e.vertex, v);
  const Padded<T> rate =
      weighted_sum(e.own, e.vertex, v) - e.turn * (cross_product(p_rate, t) + cross_product(p, t_rate));
  const Padded<T> z = e.stiffness * (system.factors.spring * condition + system.factors.rate * rate);
  const T k = system.factors.rate * e.stiffness;
  Padded<T> jacobian[4][3], transposed[4][3];  // by columns; the transposed ones times k
  for (int i = 0; i < 4; ++i) {
    const Padded<T> y = e.turn * (e.before[i] * t - e.beside[i] * p);
    system.impulse[e.vertex[i]] -= e.own[i] * z - cross_product(y, z);
    const Padded<T> unit[3] = {{e.own[i], 0, 0, 0}, {0, e.own[i], 0, 0}, {0, 0, e.own[i], 0}};
    const Padded<T> across[3] = {__builtin_shufflevector(y, y, 3, 2, 1, 3) * Padded<T>{0, 1, -1, 0},
                                 __builtin_shufflevector(y, y, 2, 3, 0, 3) * Padded<T>{-1, 0, 1, 0},
                                 __builtin_shufflevector(y, y, 1, 0, 3, 3) * Padded<T>{1, -1, 0, 0}};
    for (int c = 0; c < 3; ++c) {
      jacobian[i][c] = unit[c] + across[c];
      transposed[i][c] = k * (unit[c] - across[c]);
    }
  }
  const auto add = [&](std::int32_t slot, int i, int j) {
    system.matrix.add(slot, block_times(transposed[i], jacobian[j][0]),
                      block_times(transposed[i], jacobian[j][1]), block_times(transposed[i], jacobian[j][2]));
  };
  add(e.slot[0], 0, 0), add(e.slot[1], 1, 1), add(e.slot[2], 2, 2), add(e.slot[3], 3, 3);
  add(e.slot[4], 0, 1), add(e.slot[5], 0, 2), add(e.slot[6], 0, 3);
  add(e.slot[7], 1, 2), add(e.slot[8], 1, 3), add(e.slot[9], 2, 3);
}

template <class T>
RINGLET_KERNEL T volume_condition(const MeshVolume<T>& e, const Padded<T>* x) {
  const Padded<T> o = x[e.vertex[0]], a = x[e.vertex[1]] - o, b = x[e.vertex[2]] - o, c = x[e.vertex[3]] - o;
  return e.scale * dot_product(a, cross_product(b, c)) - e.rest;
}
template <class T>
RINGLET_KERNEL T energy(const MeshVolume<T>& e, const Padded<T>* x) {
  const T c = volume_condition(e, x);
  return T(0.5) * e.stiffness * c * c;
}
// The gradient stays what it is where a tetrahedron is flat or inverted, and always points to the rest
// volume.
template <class T>
RINGLET_KERNEL void add_to(const StepSystem<T>& system, const MeshVolume<T>& e) {
  const Padded<T>*x = system.position, *v = system.velocity;
  const std::int32_t* n = e.vertex;
  const Padded<T> a = x[n[1]] - x[n[0]], b = x[n[2]] - x[n[0]], c = x[n[3]] - x[n[0]];
  Padded<T> g[4];
  g[1] = e.scale * cross_product(b, c);
  const T condition = dot_product(a, g[1]) - e.rest;
  g[2] = e.scale * cross_product(c, a), g[3] = e.scale * cross_product(a, b);
  g[0] = -(g[1] + g[2] + g[3]);
  const T rate = dot_product(g[0], v[n[0]]) + dot_product(g[1], v[n[1]]) +
                 (dot_product(g[2], v[n[2]]) + dot_product(g[3], v[n[3]]));
  const T size = e.stiffness * (system.factors.spring * condition + system.factors.rate * rate);
  for (int i = 0; i < 4; ++i) system.impulse[n[i]] -= size * g[i];
  const T k = system.factors.rate * e.stiffness;
  Padded<T> kg[4];
  for (int i = 0; i < 4; ++i) kg[i] = k * g[i];
  for (int i = 0; i < 4; ++i) system.matrix.add_outer(e.slot[i], kg[i], g[i]);
  system.matrix.add_outer(e.slot[4], kg[0], g[1]), system.matrix.add_outer(e.slot[5], kg[0], g[2]);
  system.matrix.add_outer(e.slot[6], kg[0], g[3]), system.matrix.add_outer(e.slot[7], kg[1], g[2]);
  system.matrix.add_outer(e.slot[8], kg[1], g[3]), system.matrix.add_outer(e.slot[9], kg[2], g[3]);
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
