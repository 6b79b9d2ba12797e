// HDF5's C interface with owners and typed errors; private to the room.
//
// Files are built in memory and written by write_atomically: a full disk is then met by plain file output,
// which says so and cleans up, and never by the library, which after a failed flush can neither go on nor
// close.
#pragma once
#include <hdf5.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace ringlet::cache::h5 {

using Dims = std::vector<hsize_t>;
inline constexpr hsize_t kAny = ~hsize_t{0};  // a dimension of any size, where a shape is expected

// Owns an HDF5 identifier.
class Id {
 public:
  using Close = herr_t (*)(hid_t);
  Id() = default;
  Id(hid_t id, Close close) : id_(id), close_(close) {}
  Id(Id&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
  Id& operator=(Id&& other) noexcept {
    std::swap(id_, other.id_);
    std::swap(close_, other.close_);
    return *this;
  }
  ~Id() {
    if (id_ >= 0) close_(id_);
  }
  operator hid_t() const { return id_; }

 private:
  hid_t id_ = -1;
  Close close_ = nullptr;
};

template <class T>
hid_t native_type();
template <>
inline hid_t native_type<float>() {
  return H5T_NATIVE_FLOAT;
}
template <>
inline hid_t native_type<double>() {
  return H5T_NATIVE_DOUBLE;
}
template <>
inline hid_t native_type<std::int32_t>() {
  return H5T_NATIVE_INT32;
}
template <>
inline hid_t native_type<std::int64_t>() {
  return H5T_NATIVE_INT64;
}
template <>
inline hid_t native_type<std::uint32_t>() {
  return H5T_NATIVE_UINT32;
}
template <>
inline hid_t native_type<std::byte>() {
  return H5T_NATIVE_UINT8;
}

// One source of rows of a virtual data set: row `row` of it is all of the source.
struct Mapping {
  hsize_t row;
  std::string file;  // relative to the file that holds the virtual data set
};

// A file, group or data set. Every member throws Error{kInput} naming the file, and the object where there is
// one.
class Object {
 public:
  // Attributes. Strings are UTF-8 of variable length: h5py gives them as str.
  void set(const std::string& name, const std::string& value) const;
  template <class T>
  void set(const std::string& name, T value) const {
    set_number(name, native_type<T>(), &value);
  }
  bool has_attribute(const std::string& name) const;
  std::vector<std::string> attributes() const;  // in the order of their creation where the object tracks it
  std::string text(const std::string& name) const;
  template <class T>
  T number(const std::string& name) const {
    T value{};
    get_number(name, native_type<T>(), &value);
    return value;
  }

  // Children.
  Object create_group(const std::string& name) const;
  Object group(const std::string& name) const;
  bool has(const std::string& name) const;
  std::vector<std::string> children() const;  // in the order of their creation where the group tracks it

  // Data sets.
  template <class T>
  Object write(const std::string& name, std::span<const T> values, const Dims& dims) const {
    return write_array(name, native_type<T>(), values.data(), values.size(), dims);
  }
  Object write_deflated(const std::string& name, std::span<const float> values, const Dims& dims) const;
  Object write_strings(const std::string& name, const std::vector<std::string>& values) const;
  Object write_string(const std::string& name, const std::string& value) const;
  // [rows, dims of a source ...] of float or int32; rows without a mapping, and those whose file is gone,
  // read as NaN or -1.
  template <class T>
  Object write_virtual(const std::string& name, hsize_t rows, const Dims& source_dims,
                       const std::string& source, const std::vector<Mapping>& mappings) const {
    const T missing = std::is_floating_point_v<T> ? std::numeric_limits<T>::quiet_NaN() : T(-1);
    return make_virtual(name, rows, source_dims, source, mappings, native_type<T>(), &missing);
  }

  Object data_set(const std::string& name) const;
  Dims dims() const;  // of a data set
  std::uint64_t stored_bytes() const;
  // All of a data set. Its shape must be `expected`; nothing is allocated that the file cannot hold.
  template <class T>
  std::vector<T> read(const std::string& name, const Dims& expected) const {
    const Object set = data_set(name);
    std::vector<T> values(set.checked_size(expected, sizeof(T)));
    set.read_array(native_type<T>(), values.data());
    return values;
  }
  std::vector<std::string> read_strings(const std::string& name) const;
  std::string read_string(const std::string& name) const;

  [[noreturn]] void fail(const std::string& what) const;

 protected:
  Object(Id id, std::shared_ptr<const std::filesystem::path> file, std::string path)
      : id_(std::move(id)), file_(std::move(file)), path_(std::move(path)) {}

  std::string child_path(const std::string& name) const;
  hid_t check(hid_t result, const std::string& what) const;
  void set_number(const std::string& name, hid_t type, const void* value) const;
  void get_number(const std::string& name, hid_t type, void* value) const;
  Object write_array(const std::string& name, hid_t type, const void* values, std::size_t count,
                     const Dims& dims) const;
  std::size_t checked_size(const Dims& expected, std::size_t element) const;
  void read_array(hid_t type, void* values) const;
  Object make_virtual(const std::string& name, hsize_t rows, const Dims& source_dims,
                      const std::string& source, const std::vector<Mapping>& mappings, hid_t type,
                      const void* missing) const;

  Id id_;
  std::shared_ptr<const std::filesystem::path> file_;
  std::string path_;  // in the file: "/strands"
};

// A file being built in memory. Its bytes depend on what is written and on nothing else (no time stamps).
class Image : public Object {
 public:
  // `path` names it in messages; `bytes` is about what it will hold.
  explicit Image(const std::filesystem::path& path, std::size_t bytes = 0);
  std::vector<std::byte> bytes() const;  // with the checksum
};

// A file opened for reading, without locks: the files are never changed in place.
class File : public Object {
 public:
  explicit File(const std::filesystem::path& path);
};

// Whether the file exists and begins as HDF5 files do.
bool is_hdf5(const std::filesystem::path& path);

}  // namespace ringlet::cache::h5
