// Meshes, scene blocks and files that the tests of the solids share.
#pragma once
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>
#include <vector>

#include "core/geometry.h"
#include "scene/scene_desc.h"

namespace ringlet::solids {

struct Shape {
  std::vector<Vec3> vertices;
  std::vector<Triangle> triangles;

  void append(const Shape& other) {
    const auto first = static_cast<std::int32_t>(vertices.size());
    vertices.insert(vertices.end(), other.vertices.begin(), other.vertices.end());
    for (const Triangle& t : other.triangles) triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
  Shape turned_inside_out() const {
    Shape result = *this;
    for (Triangle& t : result.triangles) std::swap(t[1], t[2]);
    return result;
  }
};

// A closed sphere of `rings` x `segments` quads, wound outward.
inline Shape sphere(double radius, const Vec3& centre = Vec3::Zero(), int rings = 48, int segments = 96) {
  Shape s;
  const auto point = [&](int i, int j) {
    const double a = std::numbers::pi * i / rings, b = 2 * std::numbers::pi * j / segments;
    return Vec3(centre + radius * Vec3(std::sin(a) * std::cos(b), std::cos(a), -std::sin(a) * std::sin(b)));
  };
  s.vertices.push_back(point(0, 0));
  for (int i = 1; i < rings; ++i)
    for (int j = 0; j < segments; ++j) s.vertices.push_back(point(i, j));
  s.vertices.push_back(point(rings, 0));
  const auto index = [&](int i, int j) {
    if (i == 0) return 0;
    if (i == rings) return static_cast<int>(s.vertices.size()) - 1;
    return 1 + (i - 1) * segments + j % segments;
  };
  for (int i = 0; i < rings; ++i)
    for (int j = 0; j < segments; ++j) {
      if (i > 0) s.triangles.push_back({index(i, j), index(i + 1, j), index(i, j + 1)});
      if (i + 1 < rings) s.triangles.push_back({index(i, j + 1), index(i + 1, j), index(i + 1, j + 1)});
    }
  return s;
}

// The side of a cylinder about z, open at both ends, wound outward.
inline Shape open_cylinder(double radius, double height, int segments, int rows = 8) {
  Shape s;
  for (int i = 0; i <= rows; ++i)
    for (int j = 0; j < segments; ++j) {
      const double b = 2 * std::numbers::pi * j / segments;
      s.vertices.emplace_back(radius * std::cos(b), radius * std::sin(b), height * i / rows);
    }
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < segments; ++j) {
      const int a = i * segments + j, b = i * segments + (j + 1) % segments;
      s.triangles.push_back({a, b, a + segments});
      s.triangles.push_back({b, b + segments, a + segments});
    }
  return s;
}

inline double signed_volume(const std::vector<Vec3>& vertices, const std::vector<Triangle>& triangles) {
  double volume = 0;
  for (const auto& [a, b, c] : triangles) {
    const auto at = [&](int v) { return vertices[static_cast<std::size_t>(v)]; };
    volume += at(a).dot(at(b).cross(at(c))) / 6;
  }
  return volume;
}

inline void write_obj(const std::filesystem::path& file, const Shape& shape) {
  std::ofstream out(file);
  out.precision(9);
  for (const Vec3& v : shape.vertices) out << "v " << v.x() << ' ' << v.y() << ' ' << v.z() << '\n';
  for (const Triangle& t : shape.triangles)
    out << "f " << t[0] + 1 << ' ' << t[1] + 1 << ' ' << t[2] + 1 << '\n';
}

// A directory of the test's own, gone after it.
class InDirectory : public testing::Test {
 protected:
  InDirectory() {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    directory =
        std::filesystem::temp_directory_path() / (std::string("ringlet_") + info->test_suite_name() + "_" +
                                                  info->name() + "_" + std::to_string(::getpid()));
    std::filesystem::create_directories(directory);
  }
  ~InDirectory() override { std::filesystem::remove_all(directory); }

  std::filesystem::path write(const std::string& name, const std::string& contents) const {
    std::ofstream(directory / name, std::ios::binary) << contents;
    return directory / name;
  }

  std::filesystem::path directory;
};

inline const scene::Units kMetresYUp{1.0, scene::Axis::kY};
inline const scene::Frames kTwoSeconds{1, 49, 24, 0};

inline scene::MeshDesc mesh_desc(const std::filesystem::path& file) {
  scene::MeshDesc desc;
  desc.file = file;
  desc.animation.interpolation = scene::Interpolation::kSmooth;
  desc.animation.loop = false;
  return desc;
}

inline scene::MeshDesc mesh_desc(const std::filesystem::path& file, const std::string& clip) {
  scene::MeshDesc desc = mesh_desc(file);
  desc.animation.clip = clip;
  return desc;
}

inline scene::Solid solid_desc(int resolution, int half_width = 3) {
  scene::Solid desc{};
  desc.name = "solid";
  desc.friction = 0.25;
  desc.offset = 0.001;
  desc.resolution = resolution;
  desc.half_width = half_width;
  return desc;
}

// Where the real assets are; empty where they are not.
inline std::filesystem::path data_file(const std::string& name) {
  const char* set = std::getenv("RINGLET_DATA");
  const std::filesystem::path file =
      std::filesystem::path(set != nullptr ? set : RINGLET_SOURCE_DIR "/../shared/data") / name;
  return std::filesystem::exists(file) ? file : std::filesystem::path();
}

}  // namespace ringlet::solids
