// Trim, lengthen, comb and re-rest against closed forms.
#include "groom/edit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "core/error.h"

namespace ringlet::groom {
namespace {

using testing::HasSubstr;
using Points = std::vector<Vec3>;

EditedStrand at_rest(const Points& points) {
  return {points, points, Points(points.size(), Vec3::Zero()), Mat3::Identity()};
}

Points line(const Vec3& from, const Vec3& step, int particles) {
  Points points;
  for (int i = 0; i < particles; ++i) points.push_back(from + i * step);
  return points;
}

// Radius 1 cm, seven particles a turn, 3 mm a turn.
Vec3 helix_at(double i) {
  const double a = 2 * std::numbers::pi * i / 7;
  return {0.01 * std::cos(a), 0.003 * i / 7, 0.01 * std::sin(a)};
}

Points helix(int particles) {
  Points points;
  for (int i = 0; i < particles; ++i) points.push_back(helix_at(i));
  return points;
}

double length(const Points& points) {
  double sum = 0;
  for (std::size_t i = 0; i + 1 < points.size(); ++i) sum += (points[i + 1] - points[i]).norm();
  return sum;
}

double distance(const Points& a, const Points& b) {
  if (a.size() != b.size()) return INFINITY;
  double most = 0;
  for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, (a[i] - b[i]).norm());
  return most;
}

scene::GroomingOperation operation(decltype(scene::GroomingOperation::what) what) {
  return {1, "", std::move(what), "/effects/grooming/0"};
}

template <class T>
scene::Trim trim(std::optional<T> scene::Trim::*shape, const T& value, bool keep_inside = false) {
  scene::Trim trim{};
  trim.*shape = value;
  trim.keep_inside = keep_inside;
  return trim;
}

scene::Trim plane(const Vec3& point, const Vec3& normal, bool keep_inside = true) {
  return trim(&scene::Trim::plane, {point, normal.normalized()}, keep_inside);
}

constexpr auto kBy = &scene::Lengthen::by, kTo = &scene::Lengthen::to, kFactor = &scene::Lengthen::factor;

scene::Lengthen lengthen(std::optional<double> scene::Lengthen::*which, double value,
                         scene::Lengthening mode = scene::Lengthening::kExtend) {
  scene::Lengthen lengthen{};
  lengthen.*which = value;
  lengthen.mode = mode;
  return lengthen;
}

scene::Lengthen extend_by(double by) { return lengthen(kBy, by); }
scene::Lengthen scale_by(double factor) { return lengthen(kFactor, factor, scene::Lengthening::kScale); }

bool apply(EditedStrand& strand, decltype(scene::GroomingOperation::what) what,
           const SignedDistance& cutter = {}) {
  return edit(strand, operation(std::move(what)), cutter);
}

Mat3 some_rotation() { return Quat(0.3, -0.5, 0.7, 0.2).normalized().toRotationMatrix(); }

// A strand that hangs elsewhere than it rests, and moves.
EditedStrand moved(const Points& rest) {
  EditedStrand strand = at_rest(rest);
  strand.rotation = some_rotation();
  for (std::size_t i = 0; i < rest.size(); ++i) {
    strand.position[i] = some_rotation() * rest[i] + Vec3(1, 2, 3);
    strand.velocity[i] = Vec3(i, 2.0 * i, -1.0 * i);
  }
  return strand;
}

// ---- Trim ------------------------------------------------------------------------------------------

TEST(GroomTrim, TheTipComesToLieOnThePlaneWithAllItHas) {
  EditedStrand strand = moved(helix(20));
  const EditedStrand before = strand;
  const Vec3 point = 0.3 * strand.position[8] + 0.7 * strand.position[9];
  const Vec3 normal = (strand.position[9] - strand.position[0]).normalized();
  ASSERT_TRUE(apply(strand, plane(point, normal)));
  // It may pass the plane sooner, at an earlier turn of the helix.
  const std::size_t tip = strand.rest.size() - 1;
  ASSERT_TRUE(tip >= 1 && tip <= 9);
  EXPECT_NEAR((strand.position[tip] - point).dot(normal), 0, 1e-12);
  const double fraction = (strand.position[tip] - before.position[tip - 1]).norm() /
                          (before.position[tip] - before.position[tip - 1]).norm();
  const auto between = [&](const Points& p) { return Vec3((1 - fraction) * p[tip - 1] + fraction * p[tip]); };
  EXPECT_LE((strand.rest[tip] - between(before.rest)).norm(), 1e-15);
  EXPECT_LE((strand.velocity[tip] - between(before.velocity)).norm(), 1e-12);
  for (std::size_t i = 0; i < tip; ++i) {
    EXPECT_EQ(strand.rest[i], before.rest[i]);
    EXPECT_EQ(strand.position[i], before.position[i]);
    EXPECT_LT((strand.position[i] - point).dot(normal), 0);
  }
  EXPECT_FALSE(apply(strand, plane(point, normal)));  // nothing is left to cut
}

TEST(GroomTrim, AStubUnderATenthOfItsSegmentIsDropped) {
  for (const auto& [cut, particles] : {std::pair(3.05, 4), {3.15, 5}, {3.0, 4}, {0.05, 1}}) {
    EditedStrand strand = at_rest(line(Vec3::Zero(), {0, 0.5, 0}, 9));
    EXPECT_TRUE(apply(strand, plane({0, 0.5 * cut, 0}, Vec3::UnitY())));
    EXPECT_EQ(strand.rest.size(), static_cast<std::size_t>(particles)) << cut;
    EXPECT_EQ(strand.position.size(), strand.rest.size());
    EXPECT_EQ(strand.velocity.size(), strand.rest.size());
  }
}

TEST(GroomTrim, EachShapeKeepsEitherSide) {
  struct Case {
    scene::Trim trim;
    double tip;  // of a strand along x from 0 to 8
  };
  const std::array<Vec3, 2> box{Vec3(2.25, -1, -1), Vec3(4.75, 1, 1)};
  const std::array<Vec3, 2> about_root{Vec3(-1, -1, -1), Vec3(4.75, 1, 1)};
  const std::array<Vec3, 2> beside{Vec3(2, 1, 1), Vec3(3, 2, 2)};
  const scene::Sphere ball{{4, 0.3, 0}, 0.5};
  const Case cases[] = {
      {plane({2.5, 0, 0}, Vec3::UnitX(), true), 2.5},
      {plane({2.5, 0, 0}, Vec3::UnitX(), false), 0},
      {plane({2.5, 0, 0}, -Vec3::UnitX(), false), 2.5},
      {plane({9, 0, 0}, Vec3::UnitX(), true), 8},
      {trim(&scene::Trim::box, box), 2.25},
      {trim(&scene::Trim::box, box, true), 0},
      {trim(&scene::Trim::box, about_root, true), 4.75},
      {trim(&scene::Trim::box, beside), 8},
      {trim(&scene::Trim::sphere, ball), 3.6},
      {trim(&scene::Trim::sphere, ball, true), 0},
      {trim(&scene::Trim::sphere, {{0, 0, 0}, 4.5}, true), 4.5},
      {trim(&scene::Trim::sphere, {{4, 0.6, 0}, 0.5}), 8},
      {trim(&scene::Trim::length, 6.5), 6.5},
      {trim(&scene::Trim::length, 8.0), 8},
      {trim(&scene::Trim::length, 80.0), 8},
  };
  for (std::size_t i = 0; i < std::size(cases); ++i) {
    EditedStrand strand = at_rest(line(Vec3::Zero(), Vec3::UnitX(), 9));
    EXPECT_EQ(apply(strand, cases[i].trim), cases[i].tip < 8) << i;
    EXPECT_NEAR(strand.position.back().x(), cases[i].tip, 1e-12) << i;
    EXPECT_FALSE(apply(strand, cases[i].trim)) << i;
  }
}

TEST(GroomTrim, ThinThingsBetweenTwoParticlesCut) {
  const std::array<Vec3, 2> sheet{Vec3(2.5, -1, -1), Vec3(2.5 + 1e-6, 1, 1)};
  const scene::Sphere bead{{2.5, 0, 0}, 1e-6};
  for (const scene::Trim& trim : {trim(&scene::Trim::box, sheet), trim(&scene::Trim::sphere, bead)}) {
    EditedStrand strand = at_rest(line(Vec3::Zero(), Vec3::UnitX(), 9));
    EXPECT_TRUE(apply(strand, trim));
    EXPECT_NEAR(strand.position.back().x(), 2.5, 1.1e-6);
  }
}

TEST(GroomTrim, RootsOnTheSurfaceItselfStay) {
  // The root is on the plane to rounding, its hair grows away from it or into what is cut away.
  const Vec3 normal = Vec3(1, 2, 3).normalized();
  for (int k = 0; k < 100; ++k) {
    const Vec3 root = Vec3(0.1, 0.7, -0.3) + k * 0.013 * normal.unitOrthogonal();
    EditedStrand away = at_rest(line(root, -0.01 * normal, 5)), into = at_rest(line(root, 0.01 * normal, 5));
    EXPECT_FALSE(apply(away, plane({0.1, 0.7, -0.3}, normal)));
    EXPECT_TRUE(apply(into, plane({0.1, 0.7, -0.3}, normal)));
    EXPECT_EQ(into.rest.size(), 1u);
    EXPECT_EQ(into.rest[0], root);
  }
}

TEST(GroomTrim, AMeshCutsWhereItsDistanceSays) {
  const scene::Trim outside = trim(&scene::Trim::mesh, scene::MeshDesc{}),
                    inside = trim(&scene::Trim::mesh, scene::MeshDesc{}, true);
  for (const double radius : {0.5, 0.02, 1e-4}) {
    const SignedDistance ball = [&](const Vec3& p) { return (p - Vec3(2.5, 0, 0)).norm() - radius; };
    EditedStrand strand = at_rest(line(Vec3::Zero(), Vec3::UnitX(), 9));
    EXPECT_TRUE(apply(strand, outside, ball));
    EXPECT_NEAR(strand.position.back().x(), 2.5 - radius, 2e-6);
    EXPECT_FALSE(apply(strand, outside, ball));
    EditedStrand within = at_rest(line({2.5, 0, 0}, Vec3::UnitX() / 64, 17));  // its length is 0.25
    EXPECT_EQ(apply(within, inside, ball), radius < 0.25);
    if (radius == 0.02) {
      EXPECT_NEAR(within.position.back().x(), 2.52, 2e-6);
    }
  }
}

TEST(GroomTrim, ByLengthGoesByTheRestShape) {
  EditedStrand strand = moved(helix(20));
  for (std::size_t i = 1; i < 20; ++i) strand.position[i] *= 2;  // stretched
  EXPECT_TRUE(apply(strand, trim(&scene::Trim::length, 0.05)));
  EXPECT_NEAR(length(strand.rest), 0.05, 1e-15);
  EXPECT_GT(length(strand.position), 0.09);
}

TEST(GroomTrim, AStrandOfOneParticleStays) {
  EditedStrand strand = at_rest({Vec3(1, 1, 1)});
  EXPECT_FALSE(apply(strand, plane({0, 0, 0}, Vec3::UnitX())));
  EXPECT_FALSE(apply(strand, extend_by(1)));
  EXPECT_FALSE(apply(strand, scale_by(2)));
  EXPECT_EQ(strand.rest.size(), 1u);
}

// ---- Lengthen --------------------------------------------------------------------------------------

TEST(GroomLengthen, AHelixGoesOnAsThatHelix) {
  const double segment = (helix_at(1) - helix_at(0)).norm();
  for (const int particles : {4, 6, 12, 30}) {
    EditedStrand strand = at_rest(helix(particles));
    ASSERT_TRUE(apply(strand, extend_by(40 * segment)));
    EXPECT_LE(distance(strand.rest, helix(particles + 40)), 1e-13) << particles;
    EXPECT_LE(distance(strand.position, helix(particles + 40)), 1e-13) << particles;
  }
}

TEST(GroomLengthen, AnArcGoesOnAsThatArcAndALineStraight) {
  Points arc;
  for (int i = 0; i < 25; ++i) arc.push_back(0.1 * Vec3(std::cos(0.2 * i), std::sin(0.2 * i), 0));
  const double segment = (arc[1] - arc[0]).norm();
  for (const std::size_t particles : {3u, 4u, 9u}) {
    EditedStrand strand = at_rest(Points(arc.begin(), arc.begin() + static_cast<std::ptrdiff_t>(particles)));
    ASSERT_TRUE(apply(strand, extend_by(static_cast<double>(25 - particles) * segment)));
    EXPECT_LE(distance(strand.rest, arc), 1e-14) << particles;
  }
  const Vec3 step = Vec3(0.1, 0.2, -0.3);
  for (const int particles : {2, 3, 4, 20}) {
    EditedStrand strand = at_rest(line({1, 2, 3}, step, particles));
    ASSERT_TRUE(apply(strand, extend_by(10 * step.norm())));
    EXPECT_LE(distance(strand.rest, line({1, 2, 3}, step, particles + 10)), 1e-13) << particles;
  }
}

TEST(GroomLengthen, WhatWasTrimmedGrowsBack) {
  const Points whole = helix(30);
  for (const double kept : {0.11, 0.5, 0.74}) {
    EditedStrand strand = at_rest(whole);
    strand.spacing = spacing(whole);
    ASSERT_TRUE(apply(strand, trim(&scene::Trim::length, kept * length(whole))));
    ASSERT_TRUE(apply(strand, lengthen(kTo, length(whole))));
    EXPECT_LE(distance(strand.rest, whole), 1e-13) << kept;
  }
}

TEST(GroomLengthen, TheLengthIsMetWithoutStubs) {
  for (double by = 0.001; by < 3; by += 0.037) {
    EditedStrand strand = at_rest(line(Vec3::Zero(), Vec3::UnitY(), 6));
    ASSERT_TRUE(apply(strand, extend_by(by)));
    EXPECT_NEAR(length(strand.rest), 5 + by, 1e-12);
    for (std::size_t i = 0; i + 1 < strand.rest.size(); ++i) {
      const double segment = (strand.rest[i + 1] - strand.rest[i]).norm();
      EXPECT_GE(segment, 0.1 - 1e-12) << by;
      EXPECT_LT(segment, 1.1) << by;
    }
  }
}

TEST(GroomLengthen, ByToAndFactorSayHowMuch) {
  using enum scene::Lengthening;
  for (const auto mode : {kExtend, kScale}) {
    const std::pair<scene::Lengthen, double> cases[] = {{lengthen(kBy, 2.0, mode), 7},
                                                        {lengthen(kTo, 9.0, mode), 9},
                                                        {lengthen(kTo, 4.0, mode), 5},
                                                        {lengthen(kFactor, 1.5, mode), 7.5},
                                                        {lengthen(kFactor, 1.0, mode), 5}};
    for (const auto& [by, expected] : cases) {
      EditedStrand strand = at_rest(line(Vec3::Zero(), Vec3::UnitY(), 6));
      EXPECT_EQ(apply(strand, by), expected > 5);
      EXPECT_NEAR(length(strand.rest), expected, 1e-12);
      EXPECT_EQ(strand.rest.size(), strand.position.size());
      EXPECT_EQ(strand.rest.size(), strand.velocity.size());
    }
  }
}

TEST(GroomLengthen, ScaleGrowsBothShapesAboutTheirRoots) {
  EditedStrand strand = moved(helix(12));
  const EditedStrand before = strand;
  ASSERT_TRUE(apply(strand, scale_by(1.5)));
  ASSERT_EQ(strand.rest.size(), before.rest.size());
  EXPECT_EQ(strand.velocity, before.velocity);
  for (std::size_t i = 0; i < 12; ++i) {
    EXPECT_LE((strand.rest[i] - (before.rest[0] + 1.5 * (before.rest[i] - before.rest[0]))).norm(), 1e-16);
    EXPECT_LE(
        (strand.position[i] - (before.position[0] + 1.5 * (before.position[i] - before.position[0]))).norm(),
        1e-15);
  }
}

TEST(GroomLengthen, AMovedStrandIsContinuedWhereItIs) {
  EditedStrand strand = moved(helix(12));
  ASSERT_TRUE(apply(strand, extend_by(20 * spacing(helix(12)))));
  EXPECT_LE(distance(strand.position, moved(helix(32)).position), 1e-12);
  EXPECT_EQ(strand.velocity.back(), Vec3(11, 22, -11));

  // Unrolled to a line along z, what is added bends on from there as it does at rest: its angles are the rest
  // shape's.
  EditedStrand straight = at_rest(helix(12));
  straight.position = line(Vec3::Zero(), spacing(helix(12)) * Vec3::UnitZ(), 12);
  ASSERT_TRUE(apply(straight, extend_by(20 * spacing(helix(12)))));
  const auto cosine = [](const Points& p, std::size_t i) {
    return (p[i] - p[i - 1]).normalized().dot((p[i + 1] - p[i]).normalized());
  };
  for (std::size_t i = 11; i + 1 < straight.rest.size(); ++i)
    EXPECT_NEAR(cosine(straight.position, i), cosine(straight.rest, i), 1e-12);
}

TEST(GroomLengthen, NoisyRestShapesAreContinuedWithTheirCurl) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> noise(-1e-4, 1e-4);
  Points rough = helix(30);
  for (Vec3& point : rough) point += Vec3(noise(random), noise(random), noise(random));
  EditedStrand strand = at_rest(rough);
  ASSERT_TRUE(apply(strand, extend_by(14 * spacing(rough))));  // two turns more
  EXPECT_LE((strand.rest[36] - helix_at(36)).norm(), 0.2 * 0.01);
}

TEST(GroomLengthen, CoincidingParticlesAreNoDirection) {
  EditedStrand none = at_rest(Points(4, Vec3(1, 2, 3)));
  EXPECT_FALSE(apply(none, extend_by(1)));
  Points folded = line(Vec3::Zero(), Vec3::UnitX(), 4);
  folded.push_back(folded.back());
  EditedStrand strand = at_rest(folded);
  ASSERT_TRUE(apply(strand, extend_by(2)));
  EXPECT_NEAR(strand.rest.back().x(), 5, 1e-12);
  for (const Vec3& point : strand.position) EXPECT_TRUE(point.allFinite());
}

// ---- Comb ------------------------------------------------------------------------------------------

TEST(GroomComb, OntoAStraightCurveWithFullStrengthLandsOnIt) {
  const Points before = helix(20);
  const Vec3 along = Vec3(1, -2, 0.5).normalized();
  EditedStrand strand = at_rest(before);
  ASSERT_TRUE(apply(strand, scene::Comb{{before[0], before[0] + 0.17 * along}, 0.02, 1}));
  double at = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (i > 0) at += (before[i] - before[i - 1]).norm();
    EXPECT_LE((strand.rest[i] - (before[0] + at * along)).norm(), 1e-14) << i;
  }
  EXPECT_EQ(strand.position, before);
}

TEST(GroomComb, WithoutStrengthOrReachNothingChangesByABit) {
  const Points before = helix(20);
  for (const auto& [radius, strength, beside] : {std::tuple(0.5, 0.0, 0.0), {0.01, 1.0, 0.1}}) {
    EditedStrand strand = moved(before);
    const EditedStrand same = strand;
    const Vec3 from = strand.position[0] + Vec3(beside, 0, 0);
    EXPECT_FALSE(apply(strand, scene::Comb{{from, from + Vec3(0, 0, 1)}, radius, strength}));
    EXPECT_EQ(strand.rest, same.rest);
    EXPECT_EQ(strand.position, same.position);
  }
}

TEST(GroomComb, KeepsTheRestLengthsOfAStrandThatIsStretched) {
  const Points before = helix(20);
  EditedStrand strand = moved(before);
  for (Vec3& point : strand.position) point = 1.1 * point;
  const Vec3 root = strand.position[0];
  ASSERT_TRUE(
      apply(strand, scene::Comb{{root, root + Vec3(0.1, 0.1, 0), root + Vec3(0.3, 0.1, 0)}, 0.05, 0.7}));
  for (std::size_t i = 0; i + 1 < before.size(); ++i)
    EXPECT_NEAR((strand.rest[i + 1] - strand.rest[i]).norm(), (before[i + 1] - before[i]).norm(), 1e-12);
}

// Out of reach the shape is turned as a whole: its angles are what they were.
// What a strand bears is not combed into its rest shape: a comb that hardly touches hardly changes it.
TEST(GroomComb, TurnsTheRestShapeAsThePresentOneTurns) {
  EditedStrand strand = at_rest(helix(20));
  for (std::size_t i = 1; i < strand.position.size(); ++i) strand.position[i].x() += 0.02 * i;  // blown aside
  strand.rotation = Quat(0.3, 0.5, -0.7, 0.2).normalized().toRotationMatrix();
  const std::vector<Vec3> before = strand.rest;
  for (const double strength : {1e-3, 1e-6, 1e-9}) {
    strand.rest = before;
    ASSERT_TRUE(apply(strand, scene::Comb{{Vec3::Zero(), Vec3::UnitX()}, 1, strength}));
    double most = 0;
    for (std::size_t i = 0; i < before.size(); ++i)
      most = std::max(most, (strand.rest[i] - before[i]).norm());
    EXPECT_LE(most, 11 * strength)
        << "19 segments, 17 cm in all, each turned by strength times half a turn at most";
    EXPECT_GT(most, 1e-3 * strength);
  }
}

TEST(GroomComb, LeavesThePrescribedSegment) {
  EditedStrand strand = at_rest(helix(20));
  strand.held = 2;
  const std::vector<Vec3> before = strand.rest;
  ASSERT_TRUE(apply(strand, scene::Comb{{Vec3::Zero(), Vec3::UnitX()}, 1, 1}));
  EXPECT_EQ(strand.rest[1], before[1]);
  EXPECT_GT((strand.rest[2] - before[2]).norm(), 1e-4);
}

TEST(GroomComb, CarriesWhatFollowsAsItIs) {
  const Points before = helix(40);
  EditedStrand strand = at_rest(before);
  ASSERT_TRUE(apply(strand, scene::Comb{{before[0], before[0] + 0.004 * Vec3::UnitZ()}, 0.006, 0.8}));
  const auto relative = [](const Points& p, std::size_t i) {
    const Vec3 a = p[i] - p[i - 1], b = p[i + 1] - p[i], c = p[i + 2] - p[i + 1];
    return Vec3(a.dot(b), b.dot(c), a.dot(b.cross(c)));
  };
  EXPECT_GT((relative(strand.rest, 1) - relative(before, 1)).norm(), 1e-6);
  for (std::size_t i = 15; i + 2 < before.size(); ++i)
    EXPECT_LE((relative(strand.rest, i) - relative(before, i)).norm(), 1e-15) << i;
}

TEST(GroomComb, PullsTowardsACurveBesideIt) {
  EditedStrand strand = at_rest(line({0.02, 0, 0}, {0, -0.005, 0}, 60));
  const scene::Comb comb{{Vec3(0, 0, 0), Vec3(0, -0.3, 0)}, 0.05, 1};
  ASSERT_TRUE(apply(strand, comb));
  for (std::size_t i = 1; i < strand.rest.size(); ++i)
    EXPECT_LT(std::abs(strand.rest[i].x()), std::abs(strand.rest[i - 1].x()) + 1e-15);
  EXPECT_LE(std::abs(strand.rest.back().x()), 1e-6);
}

TEST(GroomComb, HairThatReachesPastTheEndGoesStraightOn) {
  const scene::Comb comb{{Vec3::Zero(), 0.02 * Vec3::UnitX()}, 0.5, 1};
  EditedStrand along = at_rest(line(Vec3::Zero(), 0.01 * Vec3::UnitX(), 20));
  apply(along, comb);
  EXPECT_LE(distance(along.rest, line(Vec3::Zero(), 0.01 * Vec3::UnitX(), 20)), 1e-14);
  EditedStrand across = at_rest(line({0.03, 0.01, 0}, 0.01 * Vec3::UnitY(), 20));
  ASSERT_TRUE(apply(across, comb));
  for (std::size_t i = 1; i < 20; ++i) EXPECT_GT(across.rest[i].x(), across.rest[i - 1].x()) << i;
}

TEST(GroomComb, FindsTheWayBackFromTheOppositeDirection) {
  EditedStrand strand = at_rest(line(Vec3::Zero(), Vec3::UnitX(), 4));
  ASSERT_TRUE(apply(strand, scene::Comb{{Vec3::Zero(), -Vec3::UnitX()}, 1, 1}));
  EXPECT_LE(distance(strand.rest, line(Vec3::Zero(), -Vec3::UnitX(), 4)), 1e-12);
}

// ---- Rest ------------------------------------------------------------------------------------------

TEST(GroomRest, ThePresentShapeIsTurnedBackIntoTheRestPose) {
  EditedStrand strand = moved(helix(12));
  strand.position = helix(14);
  strand.position.resize(12);
  for (Vec3& point : strand.position) point = some_rotation() * (1.2 * point) + Vec3(5, 5, 5);
  ASSERT_TRUE(apply(strand, scene::Rest{}));
  Points expected = helix(12);
  for (Vec3& point : expected) point = 1.2 * (point - helix_at(0)) + helix_at(0);
  EXPECT_LE(distance(strand.rest, expected), 1e-14);
}

// ---- Bounds ----------------------------------------------------------------------------------------

scene::GroomingOperation random_operation(std::mt19937& random) {
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const auto mode = uniform(0, 1) < 0.7 ? scene::Lengthening::kExtend : scene::Lengthening::kScale;
  switch (random() % 7) {
    case 0:
      return operation(trim(&scene::Trim::length, uniform(0, 0.3)));
    case 1:
      return operation(plane(0.05 * Vec3::Random(), Vec3::Random()));
    case 2:
      return operation(lengthen(kBy, uniform(0, 0.2), mode));
    case 3:
      return operation(lengthen(kTo, uniform(0, 0.4), mode));
    case 4:
      return operation(lengthen(kFactor, uniform(1, 2), mode));
    case 5:
      return operation(scene::Comb{{Vec3::Zero(), 0.3 * Vec3::Random()}, 0.2, uniform(0, 1)});
    default:
      return operation(scene::Rest{});
  }
}

TEST(GroomMostParticles, AreNeverExceeded) {
  std::mt19937 random(11);
  std::size_t reached = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    Points rest = {Vec3::Zero()};
    const auto particles = 2 + random() % 20;
    const bool even = random() % 2 == 0;
    while (rest.size() < particles)
      rest.push_back(rest.back() + 0.01 * (even ? Vec3::Random().normalized() : Vec3::Random()));
    std::vector<scene::GroomingOperation> operations;
    for (auto count = 1 + random() % 6; count > 0; --count) operations.push_back(random_operation(random));
    const std::size_t most = most_particles(rest, operations);
    EditedStrand strand = at_rest(rest);
    strand.spacing = spacing(rest);
    std::size_t found = rest.size();
    for (const auto& one : operations) {
      for (Vec3& point : strand.position) point = 1.1 * point + 0.001 * Vec3::Random();
      edit(strand, one);
      found = std::max(found, strand.rest.size());
    }
    ASSERT_LE(found, most) << "trial " << trial;
    reached += found == most;
  }
  EXPECT_GT(reached, 5000u);  // and the bound is no idle one
}

TEST(GroomMostParticles, AreExactForEvenStrands) {
  const Points rest = line(Vec3::Zero(), 0.01 * Vec3::UnitX(), 21);
  const auto most = [&](std::vector<scene::GroomingOperation> operations) {
    return most_particles(rest, operations);
  };
  const auto to = [](double length) { return operation(lengthen(kTo, length)); };
  EXPECT_EQ(most({}), 21u);
  EXPECT_EQ(most({operation(extend_by(0.1))}), 31u);
  EXPECT_EQ(most({to(0.3)}), 31u);
  EXPECT_EQ(most({to(0.1)}), 21u);
  EXPECT_EQ(most({operation(scale_by(3))}), 21u);
  EXPECT_EQ(most({operation(trim(&scene::Trim::length, 0.1)), to(0.2)}), 21u);
  EXPECT_LE(most({operation(plane(Vec3::Zero(), Vec3::UnitX())), to(0.3)}), 32u);
}

// ---- Whole grooms ----------------------------------------------------------------------------------

Strands three() {  // of 5, 1 and 9 particles along x
  Strands strands;
  int number = 0;
  for (const int particles : {5, 1, 9}) {
    for (const Vec3& point : line({0, 1.0 * number, 0}, Vec3::UnitX(), particles)) {
      strands.points.push_back(point);
      strands.widths.push_back(1e-4f - 1e-5f * static_cast<float>(point.x()));
    }
    strands.offsets.push_back(static_cast<std::int64_t>(strands.points.size()));
    strands.roots.push_back({number, Vec3(1, 0, 0)});
    strands.groups.push_back(number++);
  }
  strands.group_names = {"short", "point", "long"};
  return strands;
}

TEST(GroomEdit, EverythingOfAStrandFollows) {
  Strands strands = three();
  edit(strands, operation(plane({5.5, 0, 0}, Vec3::UnitX())));
  EXPECT_THAT(strands.offsets, testing::ElementsAre(0, 5, 6, 13));
  EXPECT_EQ(strands.points.back(), Vec3(5.5, 2, 0));
  EXPECT_FLOAT_EQ(strands.widths.back(), 4.5e-5f);
  edit(strands, operation(lengthen(kTo, 7.0)));
  EXPECT_THAT(strands.offsets, testing::ElementsAre(0, 8, 9, 17));
  EXPECT_EQ(strands.widths.size(), 17u);
  EXPECT_FLOAT_EQ(strands.widths[7], 6e-5f);
  EXPECT_THAT(strands.groups, testing::ElementsAre(0, 1, 2));
}

TEST(GroomEdit, StrandsCutDownToTheirRootsAreGone) {
  Strands strands = three();
  edit(strands, operation(trim(&scene::Trim::sphere, {{0, 0, 0}, 0.5})));
  EXPECT_THAT(strands.offsets, testing::ElementsAre(0, 1, 10));  // what was one particle is still one
  EXPECT_THAT(strands.groups, testing::ElementsAre(1, 2));
  EXPECT_EQ(strands.roots[1].triangle, 2);
  EXPECT_EQ(strands.widths.size(), 10u);
  EXPECT_EQ(strands.group_names.size(), 3u);
}

TEST(GroomEdit, CombedPointsAreTheRestShape) {
  Strands strands = three();
  edit(strands, operation(scene::Comb{{Vec3::Zero(), Vec3::UnitZ()}, 0.5, 1}));
  EXPECT_LE((strands.points[4] - Vec3(0, 0, 4)).norm(), 1e-12);
  EXPECT_EQ(strands.points[14], Vec3(8, 2, 0));
}

TEST(GroomEdit, LeavingNothingIsAnErrorAndChangesNothing) {
  Strands strands = three();
  scene::GroomingOperation all = operation(plane({-1, 0, 0}, Vec3::UnitX()));
  all.pointer = "/effects/grooming/0/trim";
  try {
    edit(strands, all);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
    EXPECT_EQ(error.problems()[0].where, "/effects/grooming/0/trim");
    EXPECT_THAT(error.what(), HasSubstr("leaves nothing of any of 3 strands"));
  }
  EXPECT_EQ(strands.points, three().points);
}

}  // namespace
}  // namespace ringlet::groom
