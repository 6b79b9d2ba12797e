// What the groom tests share: files written byte by byte from the formats' specifications, and small heads.
#pragma once
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "groom/groom.h"

namespace ringlet::groom::test {

inline constexpr scene::Units kMetres{1.0, scene::Axis::kY};

class Bytes {
 public:
  template <class T>
  Bytes& add(T value) {
    const char* raw = reinterpret_cast<const char*>(&value);
    data_.insert(data_.end(), raw, raw + sizeof(T));
    return *this;
  }
  Bytes& add(const char* text, std::size_t length) {
    data_.insert(data_.end(), text, text + length);
    return *this;
  }
  Bytes& zeros(std::size_t count) {
    data_.insert(data_.end(), count, '\0');
    return *this;
  }
  Bytes& floats(const std::vector<float>& values) {
    for (const float value : values) add(value);
    return *this;
  }
  template <class T>
  Bytes& put(std::size_t offset, T value) {
    std::memcpy(data_.data() + offset, &value, sizeof(T));
    return *this;
  }
  Bytes& truncate(std::size_t bytes) {
    data_.resize(data_.size() - bytes);
    return *this;
  }
  std::size_t size() const { return data_.size(); }
  const std::vector<char>& data() const { return data_; }

 private:
  std::vector<char> data_;
};

// A directory of this test process, removed at the end.
class Folder {
 public:
  Folder()
      : path_(std::filesystem::temp_directory_path() /
              ("ringlet_groom_" + std::to_string(::getpid()) + "_" + std::to_string(count()++))) {
    std::filesystem::create_directories(path_);
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  std::filesystem::path file(const std::string& name) const { return path_ / name; }
  std::filesystem::path write(const std::string& name, const Bytes& bytes) const {
    std::ofstream(file(name), std::ios::binary)
        .write(bytes.data().data(), static_cast<std::streamsize>(bytes.size()));
    return file(name);
  }

 private:
  static int& count() {
    static int count = 0;
    return count;
  }
  std::filesystem::path path_;
};

// HAIR: two strands of 2 and 3 points, thickness per point.
inline Bytes hair_file() {
  Bytes bytes;
  bytes.add("HAIR", 4)
      .add(2u)
      .add(5u)
      .add(1u | 2u | 4u)
      .add(0u)
      .add(1.0f)
      .add(0.0f)
      .floats({0, 0, 0})
      .zeros(88);
  bytes.add(std::uint16_t{1}).add(std::uint16_t{2});
  bytes.floats({1, 2, 3, 1, 3, 3, 4, 5, 6, 4, 6, 6, 4, 7, 6});
  return bytes.floats({0.01f, 0.02f, 0.03f, 0.04f, 0.05f});
}

// HairSalon: strands of 2, 1 and 3 vertices.
inline Bytes data_file() {
  Bytes bytes;
  bytes.add(3).add(2).floats({1, 2, 3, 1, 3, 3});
  bytes.add(1).floats({9, 9, 9});
  return bytes.add(3).floats({4, 5, 6, 4, 6, 6, 4, 7, 6});
}

// TressFX 3: header of 74 words, float3 behind it. TressFX 4: header of 40 words, float4. Two strands of 2.
inline Bytes tfx3_file() {
  Bytes bytes;
  bytes.add(3.0f).add(2u).add(2u).zeros(71 * 4).put(36 * 4, 296u);
  return bytes.floats({1, 2, 3, 1, 3, 3, 4, 5, 6, 4, 6, 6});
}
inline Bytes tfx4_file() {
  Bytes bytes;
  bytes.add(4.0f).add(2u).add(2u).add(168u).zeros(36 * 4).zeros(8);
  return bytes.floats({1, 2, 3, 0, 1, 3, 3, 1, 4, 5, 6, 0, 4, 6, 6, 1});
}

// TressFX skin: header of 67 words, then mesh, triangle, three weights, reserved, for two strands.
inline Bytes skin_file() {
  Bytes bytes;
  bytes.add(1u).add(2u).zeros(65 * 4).put(34 * 4, 268u);
  bytes.add(0u).add(7u).floats({0.5f, 0.25f, 0.25f}).add(0u);
  return bytes.add(0u).add(0u).floats({0, 1, 0}).add(0u);
}

inline std::filesystem::path data(const std::string& name) {
  const char* root = std::getenv("RINGLET_DATA");
  return std::filesystem::path(root ? root : RINGLET_SOURCE_DIR "/../shared/data") / name;
}

// A head of one or several meshes that owns its arrays.
struct Head {
  std::vector<Vec3> vertices;
  std::vector<Triangle> triangles;
  std::vector<std::int32_t> mesh_of_triangle;
  std::vector<std::string> mesh_names = {"head"};

  Scalp scalp() const { return {vertices, triangles, mesh_of_triangle, mesh_names}; }
};

// A sphere of the given radius about the origin: rings x segments, outward.
inline Head sphere(int rings, int segments, double radius) {
  Head head;
  for (int r = 0; r <= rings; ++r) {
    for (int s = 0; s < segments; ++s) {
      const double a = M_PI * r / rings, b = 2 * M_PI * s / segments;
      const double across = r % rings == 0 ? 0.0 : std::sin(a);  // the poles are single points, exactly
      head.vertices.emplace_back(radius * across * std::sin(b), radius * std::cos(a),
                                 radius * across * std::cos(b));
    }
  }
  for (int r = 0; r < rings; ++r) {
    for (int s = 0; s < segments; ++s) {
      const int i = r * segments + s, j = r * segments + (s + 1) % segments;
      head.triangles.push_back({i, i + segments, j + segments});
      head.triangles.push_back({i, j + segments, j});
    }
  }
  head.mesh_of_triangle.assign(head.triangles.size(), 0);
  return head;
}

}  // namespace ringlet::groom::test
