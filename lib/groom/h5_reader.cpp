#include "groom/h5_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <type_traits>

#include "core/error.h"

namespace ringlet::groom {

namespace {
constexpr std::size_t kLongestString = 4096;

Hdf5Handle open(const std::filesystem::path& path) {
  if (!std::filesystem::exists(path)) {
    throw Error(ErrorKind::kInput, path.string(), "no such groom file",
                "check the path; it is relative to the scene file");
  }
  Hdf5Handle file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
  if (!file.valid()) {
    throw Error(ErrorKind::kInput, path.string(), "cannot be opened as HDF5",
                "the file is truncated or damaged");
  }
  return file;
}

// One fixed-length string, without what pads it.
std::string trimmed(const char* text, std::size_t length) {
  return {text, std::find(text, text + length, '\0')};
}

// Bytes of one fixed-length string of the type, read in the character set it was written in; 0: not such a
// string.
std::size_t string_bytes(const Hdf5Handle& type) {
  if (H5Tget_class(type.get()) != H5T_STRING || H5Tis_variable_str(type.get()) > 0) return 0;
  const std::size_t bytes = H5Tget_size(type.get());
  return bytes <= kLongestString ? bytes : 0;
}
}  // namespace

H5Reader::H5Reader(const std::filesystem::path& path) : path_(path), file_bytes_(0), file_(open(path)) {
  file_bytes_ = std::filesystem::file_size(path);
}

void H5Reader::fail(const std::string& name, std::string what, std::string hint) const {
  throw Error(ErrorKind::kInput, fmt::format("{}:/{}", path_.string(), name), std::move(what),
              std::move(hint));
}

bool H5Reader::has(const std::string& name) const {
  return H5Lexists(file_.get(), name.c_str(), H5P_DEFAULT) > 0;
}

Hdf5Handle H5Reader::dataset(const std::string& name) const {
  Hdf5Handle set(H5Dopen2(file_.get(), name.c_str(), H5P_DEFAULT), H5Dclose);
  if (!set.valid()) fail(name, "data set is missing or damaged", "schemas/groom.md has the layout");
  return set;
}

// Rows of a data set of the expected shape whose elements the file can truly hold: no more bytes than it
// stores, or, where it is compressed, than deflate can unpack from them (1032 to 1).
hsize_t H5Reader::rows(const Hdf5Handle& set, const std::string& name, hsize_t columns) const {
  const Hdf5Handle space(H5Dget_space(set.get()), H5Sclose), type(H5Dget_type(set.get()), H5Tclose);
  const Hdf5Handle plan(H5Dget_create_plist(set.get()), H5Pclose);
  const int rank = H5Sget_simple_extent_ndims(space.get());
  hsize_t shape[2] = {0, 1};
  if (rank != (columns == 0 ? 1 : 2))
    fail(name, fmt::format("has {} dimensions, expected {}", rank, columns == 0 ? 1 : 2));
  H5Sget_simple_extent_dims(space.get(), shape, nullptr);
  if (columns != 0 && shape[1] != columns)
    fail(name, fmt::format("has {} columns, expected {}", shape[1], columns));
  const hsize_t factor = H5Pget_nfilters(plan.get()) > 0 ? 1032 : 1;
  const hsize_t held = std::min<hsize_t>(H5Dget_storage_size(set.get()), file_bytes_) * factor;
  const hsize_t row_bytes = H5Tget_size(type.get()) * shape[1];
  if (shape[0] > held / row_bytes) {
    fail(name,
         fmt::format("says it has {} rows of {} bytes, but the file stores at most {} bytes of it", shape[0],
                     row_bytes, held),
         "the file is truncated, or its header is wrong");
  }
  return shape[0];
}

template <class T>
std::vector<T> H5Reader::read(const std::string& name, hsize_t columns) const {
  const Hdf5Handle set = dataset(name);
  const Hdf5Handle type(H5Dget_type(set.get()), H5Tclose);
  const H5T_class_t kind = H5Tget_class(type.get());
  if (kind != H5T_INTEGER && (kind != H5T_FLOAT || std::is_integral_v<T>)) {
    fail(name, std::is_integral_v<T> ? "is not of an integer type" : "is not of a number type");
  }
  std::vector<T> values(rows(set, name, columns) * std::max<hsize_t>(columns, 1));
  const hid_t memory = std::is_integral_v<T> ? H5T_NATIVE_INT64 : H5T_NATIVE_DOUBLE;
  if (!values.empty() && H5Dread(set.get(), memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0) {
    fail(name, "cannot be read", "the file is truncated or damaged");
  }
  return values;
}
template std::vector<double> H5Reader::read<double>(const std::string&, hsize_t) const;
template std::vector<std::int64_t> H5Reader::read<std::int64_t>(const std::string&, hsize_t) const;

std::vector<std::string> H5Reader::read_strings(const std::string& name) const {
  const Hdf5Handle set = dataset(name);
  const Hdf5Handle type(H5Dget_type(set.get()), H5Tclose);
  const std::size_t bytes = string_bytes(type);
  if (bytes == 0)
    fail(name, fmt::format("is not of fixed-length strings of at most {} bytes", kLongestString));
  const hsize_t count = rows(set, name, 0);
  std::vector<char> text(count * bytes);
  if (count > 0 && H5Dread(set.get(), type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, text.data()) < 0) {
    fail(name, "cannot be read", "the file is truncated or damaged");
  }
  std::vector<std::string> strings;
  for (hsize_t i = 0; i < count; ++i) strings.push_back(trimmed(text.data() + i * bytes, bytes));
  return strings;
}

Hdf5Handle H5Reader::attribute(const std::string& name) const {
  Hdf5Handle attribute(H5Aopen(file_.get(), name.c_str(), H5P_DEFAULT), H5Aclose);
  if (!attribute.valid()) fail(name, "attribute is missing", "this is no Ringlet groom (schemas/groom.md)");
  const Hdf5Handle space(H5Aget_space(attribute.get()), H5Sclose);
  if (H5Sget_simple_extent_npoints(space.get()) != 1) fail(name, "attribute is not a single value");
  return attribute;
}

double H5Reader::number_attribute(const std::string& name) const {
  const Hdf5Handle attribute = this->attribute(name);
  double value = 0;
  if (H5Aread(attribute.get(), H5T_NATIVE_DOUBLE, &value) < 0) fail(name, "attribute is not a number");
  return value;
}

// Fixed length, or the variable length that h5py writes.
std::string H5Reader::string_attribute(const std::string& name) const {
  const Hdf5Handle attribute = this->attribute(name);
  const Hdf5Handle type(H5Aget_type(attribute.get()), H5Tclose);
  if (H5Tget_class(type.get()) == H5T_STRING && H5Tis_variable_str(type.get()) > 0) {
    char* text = nullptr;
    if (H5Aread(attribute.get(), type.get(), &text) < 0 || text == nullptr)
      fail(name, "attribute cannot be read");
    const std::string value = text;
    H5free_memory(text);
    return value;
  }
  const std::size_t bytes = string_bytes(type);
  if (bytes == 0) fail(name, "attribute is not a string");
  std::string text(bytes, '\0');
  if (H5Aread(attribute.get(), type.get(), text.data()) < 0) fail(name, "attribute cannot be read");
  return trimmed(text.data(), bytes);
}

}  // namespace ringlet::groom
