// Writes small glTF files as text, their buffers embedded.
#pragma once
#include <array>
#include <cstring>
#include <string>
#include <vector>

namespace ringlet::solids {

class GltfText {
 public:
  // Adds an accessor; returns its number.
  int floats(const std::string& type, int components, const std::vector<float>& values) {
    return add(values.data(), values.size() * sizeof(float), 5126, type, values.size() / components);
  }
  int indices(const std::vector<std::uint16_t>& values) {
    return add(values.data(), values.size() * sizeof(std::uint16_t), 5123, "SCALAR", values.size());
  }
  int joints(const std::vector<std::uint16_t>& values) {
    return add(values.data(), values.size() * sizeof(std::uint16_t), 5123, "VEC4", values.size() / 4);
  }

  // `rest` holds the scenes, nodes, meshes, skins and animations as JSON members.
  std::string text(const std::string& rest) const {
    return R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":)" + std::to_string(bytes_.size()) +
           R"(,"uri":"data:application/octet-stream;base64,)" + base64() + R"("}],"bufferViews":[)" + views_ +
           R"(],"accessors":[)" + accessors_ + "]," + rest + "}";
  }

 private:
  int add(const void* data, std::size_t size, int component, const std::string& type, std::size_t count) {
    while (bytes_.size() % 4 != 0) bytes_.push_back('\0');
    const std::string comma = count_ > 0 ? "," : "";
    views_ += comma + R"({"buffer":0,"byteOffset":)" + std::to_string(bytes_.size()) + R"(,"byteLength":)" +
              std::to_string(size) + "}";
    accessors_ += comma + R"({"bufferView":)" + std::to_string(count_) + R"(,"componentType":)" +
                  std::to_string(component) + R"(,"type":")" + type + R"(","count":)" +
                  std::to_string(count) + "}";
    bytes_.append(static_cast<const char*>(data), size);
    return count_++;
  }

  std::string base64() const {
    constexpr const char* kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string result;
    for (std::size_t i = 0; i < bytes_.size(); i += 3) {
      std::array<unsigned char, 3> b{};
      const std::size_t n = std::min<std::size_t>(3, bytes_.size() - i);
      std::memcpy(b.data(), bytes_.data() + i, n);
      const unsigned word = b[0] << 16 | b[1] << 8 | b[2];
      for (std::size_t k = 0; k < 4; ++k) result += k <= n ? kDigits[word >> (18 - 6 * k) & 63] : '=';
    }
    return result;
  }

  std::string bytes_, views_, accessors_;
  int count_ = 0;
};

}  // namespace ringlet::solids
