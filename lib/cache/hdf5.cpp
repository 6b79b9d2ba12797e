#include "cache/hdf5.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <limits>
#include <numeric>
#include <utility>

#include "cache/checksum.h"
#include "cache/deflate.h"
#include "core/error.h"

namespace ringlet::cache::h5 {
namespace fs = std::filesystem;
namespace {

constexpr hsize_t kChunkRows = 32768;  // [points] 384 KiB of positions: two chunks fit HDF5's own chunk cache
constexpr std::uint64_t kMostBytesPerByte = 1100;  // deflate shrinks by 1032 at most

// The library's own message on stderr is per thread and would bypass the program's.
void silence() { H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr); }

// What the library says about the last failure: its innermost message.
std::string reason() {
  std::string text;
  const auto take_first = [](unsigned n, const H5E_error2_t* error, void* data) -> herr_t {
    if (n == 0 && error->desc) *static_cast<std::string*>(data) = error->desc;
    return 0;
  };
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, take_first, &text);
  return text;
}

Id property_list(hid_t kind) { return {H5Pcreate(kind), H5Pclose}; }

// Of a group, data set or file: no time stamps. Attributes keep the order in which they were made and stay in
// the object's header, which thereby is of the version that carries a checksum.
Id object_properties(hid_t kind) {
  Id list = property_list(kind);
  H5Pset_obj_track_times(list, false);
  H5Pset_attr_creation_order(list, H5P_CRT_ORDER_TRACKED);
  H5Pset_attr_phase_change(list, 1024, 0);
  return list;
}

// Links keep their order as well.
Id group_properties(hid_t kind) {
  Id list = object_properties(kind);
  H5Pset_link_creation_order(list, H5P_CRT_ORDER_TRACKED | H5P_CRT_ORDER_INDEXED);
  return list;
}

Id string_type() {
  Id type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type, H5T_VARIABLE);
  H5Tset_cset(type, H5T_CSET_UTF8);
  return type;
}

Id space(const Dims& dims) {
  if (dims.empty()) return {H5Screate(H5S_SCALAR), H5Sclose};
  return {H5Screate_simple(static_cast<int>(dims.size()), dims.data(), nullptr), H5Sclose};
}

hsize_t product(const Dims& dims) {
  return std::accumulate(dims.begin(), dims.end(), hsize_t{1}, std::multiplies<>());
}

std::string to_string(const Dims& dims) {
  std::string text;
  for (const hsize_t dim : dims)
    text += (text.empty() ? "" : ", ") + (dim == kAny ? "any" : std::to_string(dim));
  return "[" + text + "]";
}

// A per cent sign in a virtual data set's file name starts a pattern.
std::string escaped(const std::string& name) {
  std::string text;
  for (const char c : name) text += c == '%' ? "%%" : std::string(1, c);
  return text;
}

// Strings of variable length, as the library hands them out.
struct Strings {
  explicit Strings(const Id& space, std::size_t count)
      : pointers(count), type(string_type()), space_id(space) {}
  ~Strings() { H5Dvlen_reclaim(type, space_id, H5P_DEFAULT, pointers.data()); }
  Strings(const Strings&) = delete;
  Strings& operator=(const Strings&) = delete;

  std::vector<std::string> copy() const {
    std::vector<std::string> texts;
    for (const char* text : pointers) texts.emplace_back(text ? text : "");
    return texts;
  }

  std::vector<char*> pointers;
  Id type;
  hid_t space_id;
};

}  // namespace

// ---- Object -------------------------------------------------------------------------------------

void Object::fail(const std::string& what) const {
  const std::string where = path_ == "/" ? file_->string() : file_->string() + ":" + path_;
  throw Error(ErrorKind::kInput, where, what);
}

hid_t Object::check(hid_t result, const std::string& what) const {
  if (result >= 0) return result;
  const std::string why = reason();
  fail(why.empty() ? what : what + " (" + why + ")");
}

std::string Object::child_path(const std::string& name) const {
  return (path_ == "/" ? path_ : path_ + "/") + name;
}

void Object::set(const std::string& name, const std::string& value) const {
  const Id type = string_type(), scalar = space({});
  const Id attribute(
      check(H5Acreate2(id_, name.c_str(), type, scalar, H5P_DEFAULT, H5P_DEFAULT), name + " not made"),
      H5Aclose);
  const char* text = value.c_str();
  check(H5Awrite(attribute, type, &text), name + " not written");
}

void Object::set_number(const std::string& name, hid_t type, const void* value) const {
  const Id scalar = space({});
  const Id attribute(
      check(H5Acreate2(id_, name.c_str(), type, scalar, H5P_DEFAULT, H5P_DEFAULT), name + " not made"),
      H5Aclose);
  check(H5Awrite(attribute, type, value), name + " not written");
}

bool Object::has_attribute(const std::string& name) const { return H5Aexists(id_, name.c_str()) > 0; }

std::vector<std::string> Object::attributes() const {
  std::vector<std::string> names;
  const auto add = [](hid_t, const char* name, const H5A_info_t*, void* data) -> herr_t {
    static_cast<std::vector<std::string>*>(data)->emplace_back(name);
    return 0;
  };
  check(H5Aiterate2(id_, H5_INDEX_CRT_ORDER, H5_ITER_INC, nullptr, add, &names),
        "attributes cannot be listed");
  return names;
}

std::string Object::text(const std::string& name) const {
  const Id attribute(check(H5Aopen(id_, name.c_str(), H5P_DEFAULT), "attribute " + name + " is missing"),
                     H5Aclose);
  const Id scalar = space({}), type(H5Aget_type(attribute), H5Tclose),
           extent(H5Aget_space(attribute), H5Sclose);
  if (H5Tget_class(type) != H5T_STRING || H5Sget_simple_extent_npoints(extent) != 1)
    fail("attribute " + name + " is not a string");
  if (H5Tis_variable_str(type) > 0) {
    Strings strings(scalar, 1);
    check(H5Aread(attribute, strings.type, strings.pointers.data()), "attribute " + name + " cannot be read");
    return strings.copy()[0];
  }
  std::string fixed(std::min<std::size_t>(H5Tget_size(type), 65536), '\0');  // an attribute holds no more
  check(H5Aread(attribute, type, fixed.data()), "attribute " + name + " cannot be read");
  return fixed.c_str();
}

void Object::get_number(const std::string& name, hid_t type, void* value) const {
  const Id attribute(check(H5Aopen(id_, name.c_str(), H5P_DEFAULT), "attribute " + name + " is missing"),
                     H5Aclose);
  const Id extent(H5Aget_space(attribute), H5Sclose);
  if (H5Sget_simple_extent_npoints(extent) != 1) fail("attribute " + name + " is not a single number");
  check(H5Aread(attribute, type, value), "attribute " + name + " is not a number");
}

Object Object::create_group(const std::string& name) const {
  const Id properties = group_properties(H5P_GROUP_CREATE);
  const hid_t made = H5Gcreate2(id_, name.c_str(), H5P_DEFAULT, properties, H5P_DEFAULT);
  return {Id(check(made, name + " not made"), H5Gclose), file_, child_path(name)};
}

Object Object::group(const std::string& name) const {
  const hid_t opened = H5Gopen2(id_, name.c_str(), H5P_DEFAULT);
  return {Id(check(opened, "group " + name + " is missing"), H5Gclose), file_, child_path(name)};
}

bool Object::has(const std::string& name) const { return H5Lexists(id_, name.c_str(), H5P_DEFAULT) > 0; }

std::vector<std::string> Object::children() const {
  std::vector<std::string> names;
  const auto add = [](hid_t, const char* name, const H5L_info_t*, void* data) -> herr_t {
    static_cast<std::vector<std::string>*>(data)->emplace_back(name);
    return 0;
  };
  const auto by_creation = H5Literate(id_, H5_INDEX_CRT_ORDER, H5_ITER_INC, nullptr, add, &names);
  if (by_creation < 0) {
    names.clear();
    check(H5Literate(id_, H5_INDEX_NAME, H5_ITER_INC, nullptr, add, &names), "members cannot be listed");
  }
  return names;
}

// ---- Data sets ----------------------------------------------------------------------------------

Object Object::write_array(const std::string& name, hid_t type, const void* values, std::size_t count,
                           const Dims& dims) const {
  if (product(dims) != count)
    fail(name + " has " + std::to_string(count) + " values for a shape of " + to_string(dims));
  const Id extent = space(dims), properties = object_properties(H5P_DATASET_CREATE);
  const hid_t made = H5Dcreate2(id_, name.c_str(), type, extent, H5P_DEFAULT, properties, H5P_DEFAULT);
  Object set(Id(check(made, name + " not made"), H5Dclose), file_, child_path(name));
  if (count != 0)
    check(H5Dwrite(set.id_, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values), name + " not written");
  return set;
}

Object Object::write_deflated(const std::string& name, std::span<const float> values,
                              const Dims& dims) const {
  if (values.empty()) return write(name, values, dims);
  if (product(dims) != values.size()) fail(name + " does not fill its shape " + to_string(dims));
  const hsize_t rows = dims[0], width = values.size() / rows;
  const hsize_t chunks = (rows + kChunkRows - 1) / kChunkRows, chunk_rows = (rows + chunks - 1) / chunks;
  Dims chunk_dims = dims;
  chunk_dims[0] = chunk_rows;
  const Id extent = space(dims), properties = object_properties(H5P_DATASET_CREATE);
  H5Pset_chunk(properties, static_cast<int>(dims.size()), chunk_dims.data());
  H5Pset_shuffle(properties);
  H5Pset_deflate(properties, 1);
  const hid_t made =
      H5Dcreate2(id_, name.c_str(), H5T_IEEE_F32LE, extent, H5P_DEFAULT, properties, H5P_DEFAULT);
  Object set(Id(check(made, name + " not made"), H5Dclose), file_, child_path(name));

  std::vector<float> padded;  // the last chunk is stored whole
  for (hsize_t row = 0; row < rows; row += chunk_rows) {
    std::span<const float> chunk = values.subspan(row * width, std::min(chunk_rows, rows - row) * width);
    if (chunk.size() < chunk_rows * width) {
      padded.assign(chunk.begin(), chunk.end());
      padded.resize(chunk_rows * width);
      chunk = padded;
    }
    const std::vector<std::byte> bytes = shuffle_and_deflate(chunk);
    Dims offset(dims.size(), 0);
    offset[0] = row;
    check(H5Dwrite_chunk(set.id_, H5P_DEFAULT, 0, offset.data(), bytes.size(), bytes.data()),
          name + " not written");
  }
  return set;
}

Object Object::write_strings(const std::string& name, const std::vector<std::string>& values) const {
  std::vector<const char*> pointers;
  for (const std::string& value : values) pointers.push_back(value.c_str());
  const Id type = string_type();
  return write_array(name, type, pointers.data(), pointers.size(), {pointers.size()});
}

Object Object::write_string(const std::string& name, const std::string& value) const {
  const char* pointer = value.c_str();
  const Id type = string_type();
  return write_array(name, type, &pointer, 1, {});
}

Object Object::make_virtual(const std::string& name, hsize_t rows, const Dims& source_dims,
                            const std::string& source, const std::vector<Mapping>& mappings, hid_t type,
                            const void* missing) const {
  Dims dims = source_dims;
  dims.insert(dims.begin(), rows);
  Dims start(dims.size(), 0), count = dims;
  count[0] = 1;
  const Id extent = space(dims), source_extent = space(source_dims),
           properties = object_properties(H5P_DATASET_CREATE);
  H5Pset_fill_value(properties, type, missing);
  for (const Mapping& mapping : mappings) {
    start[0] = mapping.row;
    H5Sselect_hyperslab(extent, H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr);
    check(H5Pset_virtual(properties, extent, escaped(mapping.file).c_str(), source.c_str(), source_extent),
          name + " cannot present " + mapping.file);
  }
  H5Sselect_all(extent);
  const hid_t made = H5Dcreate2(id_, name.c_str(), type, extent, H5P_DEFAULT, properties, H5P_DEFAULT);
  return {Id(check(made, name + " not made"), H5Dclose), file_, child_path(name)};
}

Object Object::data_set(const std::string& name) const {
  const hid_t opened = H5Dopen2(id_, name.c_str(), H5P_DEFAULT);
  return {Id(check(opened, "data set " + name + " is missing"), H5Dclose), file_, child_path(name)};
}

Dims Object::dims() const {
  const Id extent(check(H5Dget_space(id_), "has no shape"), H5Sclose);
  const int rank = H5Sget_simple_extent_ndims(extent);
  if (rank < 0) fail("has no shape");
  Dims dims(static_cast<std::size_t>(rank));
  H5Sget_simple_extent_dims(extent, dims.data(), nullptr);
  return dims;
}

std::uint64_t Object::stored_bytes() const { return H5Dget_storage_size(id_); }

std::size_t Object::checked_size(const Dims& expected, std::size_t element) const {
  const Dims found = dims();
  const auto fits = [](hsize_t want, hsize_t have) { return want == kAny || want == have; };
  if (!std::equal(expected.begin(), expected.end(), found.begin(), found.end(), fits))
    fail("has the shape " + to_string(found) + ", expected " + to_string(expected));
  const std::uint64_t most = stored_bytes() * kMostBytesPerByte / element;
  hsize_t count = 1;
  for (const hsize_t dim : found) {
    if (dim != 0 && count > most / dim)
      fail("claims the shape " + to_string(found) + ", more than the file holds");
    count *= dim;
  }
  return count;
}

void Object::read_array(hid_t type, void* values) const {
  check(H5Dread(id_, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values), "cannot be read: the file is damaged");
}

std::vector<std::string> Object::read_strings(const std::string& name) const {
  const Object set = data_set(name);
  const Id type(H5Dget_type(set.id_), H5Tclose), extent(H5Dget_space(set.id_), H5Sclose);
  if (H5Tis_variable_str(type) <= 0) set.fail("is not made of strings");
  const Dims dims = set.dims();
  const std::size_t count = dims.empty() ? 1 : set.checked_size({kAny}, H5Tget_size(type));
  Strings strings(extent, count);
  if (count != 0) set.read_array(strings.type, strings.pointers.data());
  return strings.copy();
}

std::string Object::read_string(const std::string& name) const {
  const std::vector<std::string> strings = read_strings(name);
  if (strings.size() != 1) fail(name + " is not one string");
  return strings[0];
}

// ---- Files --------------------------------------------------------------------------------------

namespace {

Id create_in_memory(const fs::path& path, std::size_t increment) {
  silence();
  const Id access = property_list(H5P_FILE_ACCESS), creation = group_properties(H5P_FILE_CREATE);
  // The oldest superblock: H5Fget_file_image leaves the checksum of the newer ones wrong. Up to 1.10 for
  // virtual data sets.
  H5Pset_libver_bounds(access, H5F_LIBVER_EARLIEST, H5F_LIBVER_V110);
  H5Pset_fapl_core(access, increment, false);
  const hid_t file = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, creation, access);
  if (file < 0) throw Error(ErrorKind::kIo, path.string(), "cannot be built in memory: " + reason());
  return {file, H5Fclose};
}

Id open_for_reading(const fs::path& path) {
  silence();
  std::error_code error;
  if (!fs::exists(path, error)) throw Error(ErrorKind::kInput, path.string(), "no such file");
  if (!std::ifstream(path))
    throw Error(ErrorKind::kInput, path.string(), "cannot be opened: " + std::string(std::strerror(errno)));
  if (!is_hdf5(path)) throw Error(ErrorKind::kInput, path.string(), "is not an HDF5 file");
  if (!is_sound(path))
    throw Error(ErrorKind::kInput, path.string(), "is damaged: its checksum does not match");
  const Id access = property_list(H5P_FILE_ACCESS);
  H5Pset_file_locking(access, false, true);
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, access);
  if (file < 0)
    throw Error(ErrorKind::kInput, path.string(), "is truncated or no sound HDF5 file (" + reason() + ")");
  return {file, H5Fclose};
}

}  // namespace

Image::Image(const fs::path& path, std::size_t bytes)
    : Object(create_in_memory(path, std::clamp<std::size_t>(bytes, 1 << 16, 1 << 26)),
             std::make_shared<const fs::path>(path), "/") {}

std::vector<std::byte> Image::bytes() const {
  check(H5Fflush(id_, H5F_SCOPE_LOCAL), "cannot be built in memory");
  const ssize_t size = H5Fget_file_image(id_, nullptr, 0);
  check(size, "cannot be built in memory");
  std::vector<std::byte> image(static_cast<std::size_t>(size));
  check(H5Fget_file_image(id_, image.data(), image.size()), "cannot be built in memory");
  append_checksum(image);
  return image;
}

File::File(const fs::path& path)
    : Object(open_for_reading(path), std::make_shared<const fs::path>(path), "/") {}

bool is_hdf5(const fs::path& path) {
  static constexpr char kSignature[] = "\x89HDF\r\n\x1a\n";
  char head[8] = {};
  std::ifstream file(path, std::ios::binary);
  return file.read(head, sizeof head) && std::memcmp(head, kSignature, sizeof head) == 0;
}

}  // namespace ringlet::cache::h5
