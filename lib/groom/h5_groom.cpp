// Ringlet's own groom file; schemas/groom.md is its specification.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "groom/formats.h"
#include "groom/groom.h"
#include "groom/h5_reader.h"

namespace ringlet::groom {

namespace {
constexpr const char* kFormat = "ringlet-groom";
constexpr int kVersion = 1;
constexpr const char* kAxes[] = {"x", "y", "z"};

scene::UnitsOverride read_declared(const H5Reader& file) {
  const std::string format = file.string_attribute("format");
  if (format != kFormat) {
    file.fail("format", fmt::format("is \"{}\", expected \"{}\"", format, kFormat),
              "this is no Ringlet groom");
  }
  const double version = file.number_attribute("version");
  if (version != kVersion) {
    file.fail("version", fmt::format("is {}, this program reads {}", version, kVersion),
              "use the program that wrote it");
  }
  const double metres = file.number_attribute("metres_per_unit");
  if (!std::isfinite(metres) || metres <= 0)
    file.fail("metres_per_unit", fmt::format("is {}, expected a positive number", metres));
  const std::string up = file.string_attribute("up");
  const auto axis = std::find(std::begin(kAxes), std::end(kAxes), up);
  if (axis == std::end(kAxes)) file.fail("up", fmt::format("is \"{}\", expected \"x\", \"y\" or \"z\"", up));
  return {metres, static_cast<scene::Axis>(axis - std::begin(kAxes))};
}

std::vector<std::int64_t> read_offsets(const H5Reader& file) {
  std::vector<std::int64_t> offsets = file.read<std::int64_t>("offsets", 0);
  if (offsets.size() < 2) file.fail("offsets", "the groom is empty: no strands", "write at least one strand");
  if (offsets[0] != 0) file.fail("offsets", fmt::format("begins with {}, expected 0", offsets[0]));
  for (std::size_t strand = 0; strand + 1 < offsets.size(); ++strand) {
    if (offsets[strand + 1] > offsets[strand]) continue;
    file.fail("offsets", fmt::format("strand {} goes from particle {} to {}, expected at least 1 particle",
                                     strand, offsets[strand], offsets[strand + 1]));
  }
  return offsets;
}

// The values of one array, which must have `count` rows and be finite; names the strand and particle of one
// that is not.
std::vector<double> read_finite(const H5Reader& file, const std::string& name, hsize_t columns,
                                std::int64_t count, const std::vector<std::int64_t>* offsets) {
  std::vector<double> values = file.read<double>(name, columns);
  const std::size_t width = std::max<hsize_t>(columns, 1);
  if (values.size() != count * width) {
    file.fail(name, fmt::format("has {} rows, expected {}", values.size() / width, count),
              "the file contradicts its own offsets");
  }
  const auto bad =
      std::find_if(values.begin(), values.end(), [](double value) { return !std::isfinite(value); });
  if (bad == values.end()) return values;
  const auto row = static_cast<std::int64_t>((bad - values.begin()) / width);
  if (offsets == nullptr)
    file.fail(name, fmt::format("strand {}: {} found, expected a finite number", row, *bad));
  const auto strand = std::upper_bound(offsets->begin(), offsets->end(), row) - offsets->begin() - 1;
  file.fail(name, fmt::format("strand {}, particle {}: {} found, expected a finite number", strand,
                              row - (*offsets)[strand], *bad));
}

std::vector<std::int32_t> read_indices(const H5Reader& file, const std::string& name, std::size_t count,
                                       std::int64_t lowest, std::int64_t end) {
  const std::vector<std::int64_t> values = file.read<std::int64_t>(name, 0);
  if (values.size() != count) file.fail(name, fmt::format("has {} rows, expected {}", values.size(), count));
  for (std::size_t i = 0; i < count; ++i) {
    if (values[i] >= lowest && values[i] < end) continue;
    file.fail(name, fmt::format("strand {}: {} found, expected {} to {}", i, values[i], lowest, end - 1));
  }
  return {values.begin(), values.end()};
}

std::vector<RootSite> read_roots(const H5Reader& file, std::size_t strands) {
  const std::vector<std::int32_t> triangles = read_indices(file, "root_triangles", strands, -1, INT32_MAX);
  const std::vector<double> weights =
      read_finite(file, "root_barycentrics", 3, static_cast<std::int64_t>(strands), nullptr);
  std::vector<RootSite> roots(strands);
  for (std::size_t i = 0; i < strands; ++i) {
    roots[i] = {triangles[i], Vec3(weights[3 * i], weights[3 * i + 1], weights[3 * i + 2])};
  }
  return roots;
}

class H5Writer {
 public:
  explicit H5Writer(const std::filesystem::path& path)
      : path_(path), file_(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), H5Fclose) {
    check(file_.valid());
  }

  void attribute(const char* name, hid_t type, const void* value) {
    const Hdf5Handle space(H5Screate(H5S_SCALAR), H5Sclose);
    const Hdf5Handle attribute(H5Acreate2(file_.get(), name, type, space.get(), H5P_DEFAULT, H5P_DEFAULT),
                               H5Aclose);
    check(attribute.valid() && H5Awrite(attribute.get(), type, value) >= 0);
  }

  void attribute(const char* name, const std::string& text) {
    const Hdf5Handle type = text_type(text.size());
    attribute(name, type.get(), text.data());
  }

  void dataset(const char* name, hid_t type, hsize_t rows, hsize_t columns, const void* data) {
    const hsize_t shape[2] = {rows, columns};
    const Hdf5Handle space(H5Screate_simple(columns == 0 ? 1 : 2, shape, nullptr), H5Sclose);
    const Hdf5Handle set(
        H5Dcreate2(file_.get(), name, type, space.get(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Dclose);
    check(set.valid() && H5Dwrite(set.get(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) >= 0);
  }

  void dataset(const char* name, const std::vector<std::string>& texts) {
    std::size_t bytes = 1;
    for (const std::string& text : texts) bytes = std::max(bytes, text.size());
    std::vector<char> padded(texts.size() * bytes, '\0');
    for (std::size_t i = 0; i < texts.size(); ++i)
      std::copy(texts[i].begin(), texts[i].end(), padded.begin() + i * bytes);
    const Hdf5Handle type = text_type(bytes);
    dataset(name, type.get(), texts.size(), 0, padded.data());
  }

  void close() { check(file_.close()); }

 private:
  static Hdf5Handle text_type(std::size_t bytes) {
    Hdf5Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
    H5Tset_size(type.get(), std::max<std::size_t>(bytes, 1));
    H5Tset_strpad(type.get(), H5T_STR_NULLPAD);
    H5Tset_cset(type.get(), H5T_CSET_UTF8);
    return type;
  }
  void check(bool written) const {
    if (!written) {
      throw Error(ErrorKind::kIo, path_.string(), "cannot be written",
                  "check the disk's room and your permissions");
    }
  }

  Hdf5Quiet quiet_;
  std::filesystem::path path_;
  Hdf5Handle file_;
};

void write_roots(H5Writer& out, const std::vector<RootSite>& roots) {
  std::vector<std::int32_t> triangles;
  std::vector<Vec3> weights;
  for (const RootSite& root : roots) {
    triangles.push_back(root.triangle);
    weights.push_back(root.barycentric);
  }
  out.dataset("root_triangles", H5T_NATIVE_INT32, roots.size(), 0, triangles.data());
  out.dataset("root_barycentrics", H5T_NATIVE_DOUBLE, roots.size(), 3, weights.data());
}

void write_all(const std::filesystem::path& file, const Strands& strands, scene::Axis up) {
  static_assert(sizeof(Vec3) == 3 * sizeof(double), "points are written as rows of three");
  H5Writer out(file);
  const double metres = 1;
  out.attribute("format", kFormat);
  out.attribute("version", H5T_NATIVE_INT, &kVersion);
  out.attribute("metres_per_unit", H5T_NATIVE_DOUBLE, &metres);
  out.attribute("up", kAxes[static_cast<int>(up)]);
  out.dataset("offsets", H5T_NATIVE_INT64, strands.offsets.size(), 0, strands.offsets.data());
  out.dataset("points", H5T_NATIVE_DOUBLE, strands.points.size(), 3, strands.points.data());
  out.dataset("groups", H5T_NATIVE_INT32, strands.groups.size(), 0, strands.groups.data());
  out.dataset("group_names", strands.group_names);
  if (!strands.widths.empty())
    out.dataset("widths", H5T_NATIVE_FLOAT, strands.widths.size(), 0, strands.widths.data());
  if (!strands.roots.empty()) write_roots(out, strands.roots);
  out.close();
}
}  // namespace

FileGroom read_h5(const std::filesystem::path& path) {
  const H5Reader file(path);
  FileGroom groom;
  groom.declared = read_declared(file);
  Strands& strands = groom.strands;
  strands.offsets = read_offsets(file);
  const std::vector<double> points = read_finite(file, "points", 3, strands.particles(), &strands.offsets);
  strands.points.resize(points.size() / 3);
  for (std::size_t i = 0; i < strands.points.size(); ++i)
    strands.points[i] = Eigen::Map<const Vec3>(&points[3 * i]);
  if (file.has("widths")) {
    const std::vector<double> widths = read_finite(file, "widths", 0, strands.particles(), &strands.offsets);
    strands.widths.assign(widths.begin(), widths.end());
  }
  if (file.has("root_triangles")) strands.roots = read_roots(file, strands.size());
  if (file.has("groups")) {
    strands.group_names = file.read_strings("group_names");
    strands.groups = read_indices(file, "groups", strands.size(), 0,
                                  static_cast<std::int64_t>(strands.group_names.size()));
  }
  return groom;
}

// Written aside and renamed, so that a file of this name is always whole.
void write(const std::filesystem::path& file, const Strands& strands, scene::Axis up) {
  const std::filesystem::path aside = file.string() + ".part";
  std::error_code status;
  try {
    write_all(aside, strands, up);
  } catch (const Error&) {
    std::filesystem::remove(aside, status);
    throw;
  }
  std::filesystem::rename(aside, file, status);
  if (status) throw Error(ErrorKind::kIo, file.string(), "cannot be written: " + status.message());
}

}  // namespace ringlet::groom
