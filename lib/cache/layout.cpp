#include "cache/layout.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>

#include "cache/deflate.h"
#include "core/error.h"

namespace ringlet::cache {
namespace {

constexpr std::array kContents = {Content::kMaster, Content::kFrame, Content::kState, Content::kFailed};
constexpr std::array kCompressions = {Compression::kNone, Compression::kDefault, Compression::kQuantised};

template <class T>
std::span<const T> view(const std::vector<T>& values) {
  return values;
}

std::string surface_path(std::size_t surface) { return "surfaces/" + std::to_string(surface); }

h5::Object write_floats(const h5::Object& root, const std::string& name, std::span<const float> values,
                        const h5::Dims& dims, Compression compression) {
  if (compression == Compression::kNone) return root.write(name, values, dims);
  return root.write_deflated(name, values, dims);
}

// Into `parent`/position.
void write_positions(const h5::Object& parent, const std::vector<float>& position, const Storage& storage) {
  const h5::Dims dims = {position.size() / 3, 3};
  if (storage.compression != Compression::kQuantised) {
    write_floats(parent, "position", position, dims, storage.compression);
    return;
  }
  std::vector<float> rounded = position;
  const double step = quantisation_step(storage.error);
  quantise(rounded, step);
  const h5::Object set = write_floats(parent, "position", rounded, dims, storage.compression);
  set.set("error_bound", storage.error);
  set.set("step", step);
}

void write_figures(const h5::Object& root, const state::Figures& figures) {
  const h5::Object group = root.create_group("figures");
  for (const auto& [name, value] : figures) group.set(name, value);
}

state::Figures read_figures(const h5::Object& root) {
  const h5::Object group = root.group("figures");
  state::Figures figures;
  for (const std::string& name : group.attributes()) figures.emplace_back(name, group.number<double>(name));
  return figures;
}

void write_surface_topology(const h5::Object& root, const std::vector<state::Surface>& surfaces) {
  const h5::Object group = root.create_group("surfaces");
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    const h5::Object surface = group.create_group(std::to_string(i));
    surface.set("name", surfaces[i].name);
    surface.write("triangles", view(surfaces[i].triangles), {surfaces[i].triangles.size() / 3, 3});
  }
}

std::vector<state::Surface> read_surface_topology(const h5::Object& root) {
  std::vector<state::Surface> surfaces;
  const h5::Object group = root.group("surfaces");
  for (const std::string& name : group.children()) {
    const h5::Object surface = group.group(name);
    surfaces.push_back({surface.text("name"), surface.read<std::int32_t>("triangles", {h5::kAny, 3})});
  }
  return surfaces;
}

// First particle of each guide among those of guides alone.
std::vector<std::int64_t> guide_offsets(const state::RunHeader& header) {
  std::vector<std::int64_t> offsets = {0};
  for (const std::int32_t strand : header.interpolation.guides)
    offsets.push_back(offsets.back() + header.offsets[strand + 1] - header.offsets[strand]);
  return offsets;
}

void write_interpolation(const h5::Object& root, const state::RunHeader& header) {
  const state::Interpolation& from = header.interpolation;
  const auto neighbours = static_cast<hsize_t>(from.neighbours);
  const h5::Object group = root.create_group("interpolation");
  group.write("guides", view(from.guides), {from.guides.size()});
  group.write("guide", view(from.guide), {from.guide.size() / neighbours, neighbours});
  group.write("weight", view(from.weight), {from.weight.size() / neighbours, neighbours});
  if (!from.guides_apart) return;
  const std::vector<std::int64_t> offsets = guide_offsets(header);
  root.create_group("guides").write("offsets", view(offsets), {offsets.size()});
}

state::Interpolation read_interpolation(const h5::Object& root, hsize_t strands) {
  const h5::Object group = root.group("interpolation");
  state::Interpolation to;
  to.guides = group.read<std::int32_t>("guides", {h5::kAny});
  to.guide = group.read<std::int32_t>("guide", {strands, h5::kAny});
  to.weight = group.read<float>("weight", group.data_set("guide").dims());
  to.neighbours = static_cast<std::int32_t>(group.data_set("guide").dims().at(1));
  to.guides_apart = root.has("guides");
  for (const std::int32_t strand : to.guides)
    if (strand < 0 || static_cast<hsize_t>(strand) >= strands)
      root.fail("interpolation/guides names strand " + std::to_string(strand) + ", which does not exist");
  for (const std::int32_t guide : to.guide)
    if (guide < -1 || guide >= static_cast<std::int32_t>(to.guides.size()))
      root.fail("interpolation/guide names guide " + std::to_string(guide) + " of " +
                std::to_string(to.guides.size()));
  return to;
}

void check_offsets(const h5::Object& root, const std::vector<std::int64_t>& offsets, std::size_t particles) {
  const bool sound = !offsets.empty() && offsets.front() == 0 &&
                     std::is_sorted(offsets.begin(), offsets.end()) &&
                     offsets.back() == static_cast<std::int64_t>(particles);
  if (!sound)
    root.fail("strands/offsets does not rise from 0 to the number of particles, " +
              std::to_string(particles));
}

// FNV-1a, 64 bits.
class Hash {
 public:
  template <class T>
  void add(const std::vector<T>& values) {
    add_bytes(std::as_bytes(std::span(values)));
  }
  void add(const std::string& text) { add_bytes(std::as_bytes(std::span(text.c_str(), text.size() + 1))); }
  std::uint64_t value() const { return value_; }

 private:
  void add_bytes(std::span<const std::byte> bytes) {
    for (const std::byte byte : bytes) value_ = (value_ ^ static_cast<std::uint64_t>(byte)) * 0x100000001b3u;
  }
  std::uint64_t value_ = 0xcbf29ce484222325u;
};

}  // namespace

const char* to_string(Compression compression) {
  switch (compression) {
    case Compression::kNone:
      return "none";
    case Compression::kDefault:
      return "default";
    case Compression::kQuantised:
      return "quantised";
  }
  return "";
}

const char* to_string(Content content) {
  switch (content) {
    case Content::kMaster:
      return "master";
    case Content::kFrame:
      return "frame";
    case Content::kState:
      return "state";
    case Content::kFailed:
      return "failed";
  }
  return "";
}

FrameRecord record_of(const state::Frame& frame) {
  FrameRecord record{frame.time,
                     frame.figures,
                     !frame.velocity.empty(),
                     !frame.elongation.empty(),
                     !frame.living.empty(),
                     frame.guide_position.size() / 3,
                     {}};
  for (const auto& vertices : frame.surface_vertices) record.vertices.push_back(vertices.size() / 3);
  return record;
}

// ---- Identity -----------------------------------------------------------------------------------

void write_identity(const h5::Object& root, Content content) {
  root.set("format", std::string(kFormat));
  root.set("format_version", kFormatVersion);
  root.set("content", std::string(to_string(content)));
}

Content check_identity(const h5::Object& root) {
  if (!root.has_attribute("format")) root.fail("is an HDF5 file, but not of a Ringlet cache");
  const std::string format = root.text("format");
  if (format != kFormat) root.fail("is of the format " + format + ", expected " + kFormat);
  const auto version = root.number<std::int32_t>("format_version");
  if (version < 1 || version > kFormatVersion) {
    root.fail("is of cache format " + std::to_string(version) + "; this program reads up to " +
              std::to_string(kFormatVersion));
  }
  const std::string word = root.text("content");
  for (const Content content : kContents) {
    if (word == to_string(content)) return content;
  }
  root.fail("holds '" + word + "', which this program does not know");
}

// ---- Header -------------------------------------------------------------------------------------

void write_header(const h5::Object& root, const state::RunHeader& header) {
  root.set("name", header.name);
  root.set("program_version", header.program_version);
  root.set("backend", header.backend);
  root.set("instruction_set", header.instruction_set);
  root.set("precision", header.precision);
  root.set("scene_hash", header.scene_hash);
  root.set("length_unit", header.length_unit);
  root.set("metres_per_unit", header.metres_per_unit);
  root.set("up", header.up);
  root.set("fps", header.fps);
  root.set("first_frame", static_cast<std::int32_t>(header.first_frame));
  root.set("last_frame", static_cast<std::int32_t>(header.last_frame));
  root.write_string("scene", header.scene_json);

  const hsize_t strand_count = header.root_triangle.size(), particles = header.rest_position.size() / 3;
  const h5::Object strands = root.create_group("strands");
  strands.write("offsets", view(header.offsets), {strand_count + 1});
  strands.write("root_triangle", view(header.root_triangle), {strand_count});
  strands.write("root_barycentric", view(header.root_barycentric), {strand_count, 3});
  strands.write("rest_position", view(header.rest_position), {particles, 3});
  strands.write("width", view(header.width), {particles});
  strands.write("groom", view(header.groom_of_strand), {strand_count});
  strands.write_strings("groom_names", header.groom_names);
  if (!header.interpolation.guides.empty()) write_interpolation(root, header);
  write_surface_topology(root, header.surfaces);
}

state::RunHeader read_header(const h5::Object& root) {
  state::RunHeader header;
  header.name = root.text("name");
  header.program_version = root.text("program_version");
  header.backend = root.text("backend");
  header.instruction_set = root.text("instruction_set");
  header.precision = root.text("precision");
  header.scene_hash = root.text("scene_hash");
  header.length_unit = root.text("length_unit");
  header.metres_per_unit = root.number<double>("metres_per_unit");
  header.up = root.text("up");
  header.fps = root.number<double>("fps");
  header.first_frame = root.number<std::int32_t>("first_frame");
  header.last_frame = root.number<std::int32_t>("last_frame");
  header.scene_json = root.read_string("scene");

  const h5::Object strands = root.group("strands");
  header.rest_position = strands.read<float>("rest_position", {h5::kAny, 3});
  header.offsets = strands.read<std::int64_t>("offsets", {h5::kAny});
  const hsize_t particles = header.rest_position.size() / 3;
  check_offsets(root, header.offsets, particles);
  const hsize_t strand_count = header.offsets.size() - 1;
  header.root_triangle = strands.read<std::int32_t>("root_triangle", {strand_count});
  header.root_barycentric = strands.read<float>("root_barycentric", {strand_count, 3});
  header.width = strands.read<float>("width", {particles});
  header.groom_of_strand = strands.read<std::int32_t>("groom", {strand_count});
  header.groom_names = strands.read_strings("groom_names");
  if (root.has("interpolation")) header.interpolation = read_interpolation(root, strand_count);
  header.surfaces = read_surface_topology(root);
  return header;
}

void write_storage(const h5::Object& root, const Storage& storage) {
  root.set("compression", std::string(to_string(storage.compression)));
  if (storage.compression == Compression::kQuantised) root.set("error_bound", storage.error);
}

Storage read_storage(const h5::Object& root) {
  const std::string word = root.text("compression");
  for (const Compression compression : kCompressions) {
    if (word != to_string(compression)) continue;
    return {compression, compression == Compression::kQuantised ? root.number<double>("error_bound") : 0};
  }
  root.fail("is compressed by '" + word + "', which this program does not know");
}

// ---- Frames -------------------------------------------------------------------------------------

void write_frame(const h5::Object& root, const state::Frame& frame, const Storage& storage) {
  root.set("frame", static_cast<std::int32_t>(frame.number));
  root.set("time", frame.time);
  write_positions(root, frame.position, storage);
  if (!frame.velocity.empty())
    write_floats(root, "velocity", frame.velocity, {frame.velocity.size() / 3, 3}, storage.compression);
  if (!frame.elongation.empty())
    write_floats(root, "elongation", frame.elongation, {frame.elongation.size()}, storage.compression);
  if (!frame.living.empty()) root.write("living", view(frame.living), {frame.living.size()});
  if (!frame.guide_position.empty())
    write_positions(root.create_group("guides"), frame.guide_position, storage);
  write_figures(root, frame.figures);
  if (frame.surface_vertices.empty()) return;
  const h5::Object surfaces = root.create_group("surfaces");
  for (std::size_t i = 0; i < frame.surface_vertices.size(); ++i) {
    const auto& vertices = frame.surface_vertices[i];
    write_floats(surfaces.create_group(std::to_string(i)), "vertices", vertices, {vertices.size() / 3, 3},
                 storage.compression);
  }
}

namespace {

std::vector<std::int32_t> read_living(const h5::Object& root, const state::RunHeader* header) {
  const hsize_t strands = header ? header->root_triangle.size() : h5::kAny;
  std::vector<std::int32_t> living = root.read<std::int32_t>("living", {strands});
  for (std::size_t s = 0; s < living.size(); ++s)
    if (living[s] < 1 || (header && living[s] > header->offsets[s + 1] - header->offsets[s]))
      root.fail("living tells of " + std::to_string(living[s]) + " particles of strand " + std::to_string(s) +
                ", which has no such number");
  return living;
}

}  // namespace

state::Frame read_frame(const h5::Object& root, const state::RunHeader* header) {
  const hsize_t particles = header ? header->rest_position.size() / 3 : h5::kAny;
  state::Frame frame;
  frame.number = root.number<std::int32_t>("frame");
  frame.time = root.number<double>("time");
  frame.position = root.read<float>("position", {particles, 3});
  if (root.has("velocity")) frame.velocity = root.read<float>("velocity", {frame.position.size() / 3, 3});
  if (root.has("elongation")) frame.elongation = root.read<float>("elongation", {frame.position.size() / 3});
  if (root.has("living")) frame.living = read_living(root, header);
  if (root.has("guides")) frame.guide_position = root.group("guides").read<float>("position", {h5::kAny, 3});
  frame.figures = read_figures(root);
  if (!root.has("surfaces")) return frame;
  const h5::Object surfaces = root.group("surfaces");
  for (const std::string& name : surfaces.children())
    frame.surface_vertices.push_back(surfaces.group(name).read<float>("vertices", {h5::kAny, 3}));
  return frame;
}

FrameRecord read_record(const h5::Object& root) {
  FrameRecord record{root.number<double>("time"),
                     read_figures(root),
                     root.has("velocity"),
                     root.has("elongation"),
                     root.has("living"),
                     0,
                     {}};
  if (root.has("guides")) record.guide_particles = root.group("guides").data_set("position").dims().at(0);
  if (!root.has("surfaces")) return record;
  const h5::Object surfaces = root.group("surfaces");
  for (const std::string& name : surfaces.children())
    record.vertices.push_back(surfaces.group(name).data_set("vertices").dims().at(0));
  return record;
}

// ---- The sequence -------------------------------------------------------------------------------

namespace {

void write_tables(const h5::Object& root, const std::map<int, FrameRecord>& frames) {
  std::vector<std::int32_t> numbers;
  std::vector<double> times;
  std::vector<std::string> names;  // in the order in which the frames bring them
  for (const auto& [number, record] : frames) {
    numbers.push_back(number);
    times.push_back(record.time);
    for (const auto& [name, value] : record.figures)
      if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }
  root.write("frames", view(numbers), {numbers.size()});
  root.write("time", view(times), {times.size()});

  const h5::Object group = root.create_group("figures");
  for (const std::string& name : names) {
    std::vector<double> column;
    for (const auto& [number, record] : frames) {
      const auto named = [&](const auto& figure) { return figure.first == name; };
      const auto figure = std::find_if(record.figures.begin(), record.figures.end(), named);
      column.push_back(figure != record.figures.end() ? figure->second
                                                      : std::numeric_limits<double>::quiet_NaN());
    }
    group.write(name, view(column), {column.size()});
  }
}

// One virtual data set over those frames that have the data.
template <class T = float, class Has>
void write_field(const h5::Object& parent, const std::string& name, const std::string& source,
                 const h5::Dims& dims, const std::map<int, FrameRecord>& frames, const Files& files,
                 Has has) {
  std::vector<h5::Mapping> mappings;
  hsize_t row = 0;
  for (const auto& [number, record] : frames) {
    if (has(record)) mappings.push_back({row, files.frame_name(number)});
    ++row;
  }
  if (!mappings.empty()) parent.write_virtual<T>(name, row, dims, source, mappings);
}

}  // namespace

void write_sequence(const h5::Object& root, const std::map<int, FrameRecord>& frames,
                    const state::RunHeader& header, const Files& files) {
  write_tables(root, frames);
  const hsize_t particles = header.rest_position.size() / 3;
  write_field(root, "position", "/position", {particles, 3}, frames, files, [](const auto&) { return true; });
  write_field(root, "velocity", "/velocity", {particles, 3}, frames, files,
              [](const FrameRecord& record) { return record.velocity; });
  write_field(root, "elongation", "/elongation", {particles}, frames, files,
              [](const FrameRecord& record) { return record.elongation; });
  write_field<std::int32_t>(root, "living", "/living", {header.root_triangle.size()}, frames, files,
                            [](const FrameRecord& record) { return record.living; });
  if (header.interpolation.guides_apart) {
    const hsize_t of_guides = guide_offsets(header).back();
    write_field(root.group("guides"), "position", "/guides/position", {of_guides, 3}, frames, files,
                [=](const FrameRecord& record) { return record.guide_particles == of_guides; });
  }
  for (std::size_t i = 0; i < header.surfaces.size(); ++i) {
    const auto has = [i](const FrameRecord& record) { return i < record.vertices.size(); };
    const auto first =
        std::find_if(frames.begin(), frames.end(), [&](const auto& f) { return has(f.second); });
    if (first == frames.end()) continue;
    write_field(root.group(surface_path(i)), "vertices",
                std::string("/").append(surface_path(i)).append("/vertices"), {first->second.vertices[i], 3},
                frames, files, has);
  }
}

// ---- Failed state -------------------------------------------------------------------------------

void write_single(const h5::Object& root, const state::Frame& frame) {
  write_tables(root, {{frame.number, record_of(frame)}});
  const auto write = [](const h5::Object& parent, const std::string& name, const std::vector<float>& values) {
    parent.write_deflated(name, values, {1, values.size() / 3, 3});
  };
  write(root, "position", frame.position);
  if (!frame.velocity.empty()) write(root, "velocity", frame.velocity);
  if (!frame.elongation.empty())
    root.write_deflated("elongation", frame.elongation, {1, frame.elongation.size()});
  if (!frame.living.empty()) root.write("living", view(frame.living), {1, frame.living.size()});
  if (!frame.guide_position.empty()) write(root.group("guides"), "position", frame.guide_position);
  for (std::size_t i = 0; i < frame.surface_vertices.size(); ++i)
    write(root.group(surface_path(i)), "vertices", frame.surface_vertices[i]);
}

state::Frame read_single(const h5::Object& root, const state::RunHeader& header) {
  state::Frame frame;
  frame.number = root.read<std::int32_t>("frames", {1})[0];
  frame.time = root.read<double>("time", {1})[0];
  const h5::Dims shape = {1, header.rest_position.size() / 3, 3};
  frame.position = root.read<float>("position", shape);
  if (root.has("velocity")) frame.velocity = root.read<float>("velocity", shape);
  if (root.has("elongation")) frame.elongation = root.read<float>("elongation", {1, shape[1]});
  if (root.has("living")) frame.living = root.read<std::int32_t>("living", {1, header.root_triangle.size()});
  if (root.has("guides"))
    frame.guide_position = root.group("guides").read<float>("position", {1, h5::kAny, 3});
  const h5::Object figures = root.group("figures");
  for (const std::string& name : figures.children())
    frame.figures.emplace_back(name, figures.read<double>(name, {1})[0]);
  for (std::size_t i = 0; i < header.surfaces.size(); ++i) {
    const h5::Object surface = root.group(surface_path(i));
    if (surface.has("vertices"))
      frame.surface_vertices.push_back(surface.read<float>("vertices", {1, h5::kAny, 3}));
  }
  return frame;
}

void write_failure(const h5::Object& root, const Failure& failure) {
  root.set("message", failure.message);
  root.set("stage", failure.stage);
  root.set("strand", failure.strand);
  root.set("particle", failure.particle);
}

Failure read_failure(const h5::Object& root) {
  return {root.text("message"), root.text("stage"), root.number<std::int64_t>("strand"),
          root.number<std::int64_t>("particle")};
}

// ---- State --------------------------------------------------------------------------------------

void write_snapshot(const h5::Object& root, const state::Snapshot& snapshot, std::uint64_t header_hash) {
  root.set("frame", static_cast<std::int32_t>(snapshot.frame));
  root.set("header_hash", static_cast<std::int64_t>(header_hash));
  const h5::Object group = root.create_group("state");
  for (const auto& [name, bytes] : snapshot.arrays) group.write(name, view(bytes), {bytes.size()});
}

state::Snapshot read_snapshot(const h5::Object& root) {
  state::Snapshot snapshot;
  snapshot.frame = root.number<std::int32_t>("frame");
  const h5::Object group = root.group("state");
  for (const std::string& name : group.children())
    snapshot.arrays.emplace(name, group.read<std::byte>(name, {h5::kAny}));
  return snapshot;
}

std::uint64_t hash_of(const state::RunHeader& header) {
  Hash hash;
  hash.add(header.precision);
  hash.add(header.backend);
  hash.add(header.offsets);
  hash.add(header.root_triangle);
  hash.add(header.root_barycentric);
  hash.add(header.rest_position);
  return hash.value();
}

}  // namespace ringlet::cache
