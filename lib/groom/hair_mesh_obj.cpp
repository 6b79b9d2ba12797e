// Hair meshes as layered OBJ: one object a layer, the scalp's first, each with the same faces
// (schemas/hair_mesh.md).
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <set>

#include "core/error.h"
#include "groom/hair_mesh_formats.h"

namespace ringlet::groom {

namespace {

constexpr std::string_view kBlank = " \t\r";

// The words of a line, without its comment.
std::vector<std::string_view> words_of(std::string_view line) {
  line = line.substr(0, line.find('#'));
  std::vector<std::string_view> words;
  while (true) {
    const std::size_t begin = line.find_first_not_of(kBlank);
    if (begin == std::string_view::npos) return words;
    line.remove_prefix(begin);
    const std::size_t end = std::min(line.find_first_of(kBlank), line.size());
    words.push_back(line.substr(0, end));
    line.remove_prefix(end);
  }
}

template <class T>
bool parse_number(std::string_view word, T& value) {
  if (word.starts_with('+')) word.remove_prefix(1);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return error == std::errc() && end == word.data() + word.size();
}

struct Layer {
  std::string name;
  std::size_t line;        // of its `o`
  std::size_t first, end;  // vertices, of all of the file's
  std::vector<HairMesh::Face> faces;
  std::vector<std::size_t> face_lines;
  std::vector<std::string> face_groups;
};

class Reader {
 public:
  Reader(std::string_view text, const std::string& name) : text_(text), name_(name) {}

  FileHairMesh read() {
    for (std::size_t at = 0; at < text_.size();) {
      const std::size_t end = std::min(text_.find('\n', at), text_.size());
      read_line(text_.substr(at, end - at), ++line_);
      at = end + 1;
    }
    if (layers_.empty())
      fail(line_, "no object in the file, expected one for each layer", "write `o NAME` before each layer");
    for (Layer& layer : layers_) localise(layer);
    for (std::size_t k = 1; k < layers_.size(); ++k) compare_with_scalp(k);
    return assemble();
  }

 private:
  [[noreturn]] void fail(std::size_t line, std::string what, std::string hint = {}) const {
    throw Error(ErrorKind::kInput, fmt::format("{}:{}", name_, line), std::move(what), std::move(hint));
  }

  std::string name_of(std::size_t k) const { return fmt::format("layer {} (object {})", k, layers_[k].name); }

  void read_line(std::string_view line, std::size_t number) {
    // What OBJ knows and a hair mesh has no use for.
    static const std::set<std::string_view> kUnused = {"vt", "vn", "vp", "s", "usemtl", "mtllib", "l", "p"};
    const std::vector<std::string_view> words = words_of(line);
    if (words.empty() || kUnused.contains(words[0])) return;
    const std::vector<std::string_view> values(words.begin() + 1, words.end());
    if (words[0] == "o")
      open_layer(values, number);
    else if (words[0] == "v")
      read_vertex(values, number);
    else if (words[0] == "f")
      read_face(values, number);
    else if (words[0] == "g")
      group_ = values.empty() ? std::string() : std::string(values[0]);
    else
      fail(number, fmt::format("unknown statement `{}`", words[0]), "a hair mesh has o, g, v and f");
  }

  void open_layer(const std::vector<std::string_view>& names, std::size_t number) {
    layers_.push_back({names.empty() ? std::string() : std::string(names[0]),
                       number,
                       vertices_.size(),
                       vertices_.size(),
                       {},
                       {},
                       {}});
    group_.clear();
  }

  Layer& layer(std::size_t number, const char* what) {
    if (layers_.empty())
      fail(number, fmt::format("a {} before the first object", what), "write `o NAME` before each layer");
    return layers_.back();
  }

  void read_vertex(const std::vector<std::string_view>& values, std::size_t number) {
    Layer& of = layer(number, "vertex");
    if (values.size() < 3) fail(number, fmt::format("a vertex of {} numbers, expected three", values.size()));
    Vec3 point;
    for (int k = 0; k < 3; ++k)
      if (!parse_number(values[k], point[k]))
        fail(number, fmt::format("found `{}`, expected a number", values[k]));
    vertices_.push_back(point);
    of.end = vertices_.size();
  }

  void read_face(const std::vector<std::string_view>& values, std::size_t number) {
    Layer& of = layer(number, "face");
    if (values.size() != 3 && values.size() != 4)
      fail(number, fmt::format("a face of {} vertices, expected three or four", values.size()),
           "make larger faces into quads and triangles");
    HairMesh::Face face{-1, -1, -1, -1};
    for (std::size_t c = 0; c < values.size(); ++c) face[c] = read_index(values[c], number);
    of.faces.push_back(face);
    of.face_lines.push_back(number);
    of.face_groups.push_back(group_);
  }

  // The vertex of `7`, `7/1`, `7//3` or `7/1/3`, counted from 1 through the whole file, or backwards from the
  // last vertex so far where it is negative. It may come later in the file: whether it exists is seen at the
  // end.
  std::int32_t read_index(std::string_view word, std::size_t number) const {
    std::int32_t index = 0;
    const std::string_view vertex = word.substr(0, word.find('/'));
    if (!parse_number(vertex, index) || index == 0)
      fail(number, fmt::format("found `{}`, expected the number of a vertex", word),
           "vertices are numbered from 1");
    if (index > 0) return index - 1;
    const std::int64_t from_end = static_cast<std::int64_t>(vertices_.size()) + index;
    if (from_end < 0)
      fail(number, fmt::format("vertex {} does not exist: {} come before", index, vertices_.size()));
    return static_cast<std::int32_t>(from_end);
  }

  // Numbers a layer's vertices from 0.
  void localise(Layer& layer) {
    const auto k = static_cast<std::size_t>(&layer - layers_.data());
    if (layer.faces.empty())
      fail(layer.line, fmt::format("{} has no faces", name_of(k)), "each layer has the same");
    for (std::size_t f = 0; f < layer.faces.size(); ++f) {
      for (int c = 0; c < HairMesh::corners(layer.faces[f]); ++c) {
        std::int32_t& vertex = layer.faces[f][c];
        if (static_cast<std::size_t>(vertex) < layer.first || static_cast<std::size_t>(vertex) >= layer.end)
          fail(layer.face_lines[f],
               fmt::format("face {} of {} has vertex {}, the layer's are {} to {}", f, name_of(k), vertex + 1,
                           layer.first + 1, layer.end),
               "a layer's faces have its own vertices");
        vertex -= static_cast<std::int32_t>(layer.first);
      }
    }
  }

  void compare_with_scalp(std::size_t k) const {
    const Layer &scalp = layers_[0], &layer = layers_[k];
    const char* hint = "each layer has the same vertices and faces in the same order";
    if (layer.end - layer.first != scalp.end - scalp.first)
      fail(layer.line,
           fmt::format("{} has {} vertices, layer 0 has {}", name_of(k), layer.end - layer.first,
                       scalp.end - scalp.first),
           hint);
    if (layer.faces.size() != scalp.faces.size())
      fail(layer.line,
           fmt::format("{} has {} faces, layer 0 has {}", name_of(k), layer.faces.size(), scalp.faces.size()),
           hint);
    for (std::size_t f = 0; f < scalp.faces.size(); ++f)
      if (layer.faces[f] != scalp.faces[f])
        fail(layer.face_lines[f], fmt::format("face {} of {} is not that of layer 0", f, name_of(k)), hint);
  }

  FileHairMesh assemble() {
    FileHairMesh result;
    HairMesh& mesh = result.mesh;
    mesh.faces = layers_[0].faces;
    mesh.layers = static_cast<int>(layers_.size());
    for (const Layer& layer : layers_)
      mesh.positions.insert(mesh.positions.end(), vertices_.begin() + layer.first,
                            vertices_.begin() + layer.end);
    const std::vector<std::string>& groups = layers_[0].face_groups;
    if (std::all_of(groups.begin(), groups.end(), [](const std::string& group) { return group.empty(); }))
      return result;
    std::map<std::string, std::int32_t> numbers;
    for (const std::string& group : groups) {
      const auto [found, is_new] = numbers.try_emplace(group, static_cast<std::int32_t>(numbers.size()));
      if (is_new) mesh.group_names.push_back(group);
      mesh.groups.push_back(found->second);
    }
    return result;
  }

  std::string_view text_;
  const std::string& name_;
  std::size_t line_ = 0;
  std::vector<Vec3> vertices_;  // of all layers
  std::vector<Layer> layers_;
  std::string group_;  // of the faces that follow
};

// OBJ takes a blank in a group's name for the start of another name.
std::string group_word(std::string name) {
  std::replace_if(
      name.begin(), name.end(),
      [](char c) { return c == '#' || c == '\n' || kBlank.find(c) != std::string_view::npos; }, '_');
  return name;
}

}  // namespace

FileHairMesh parse_hair_mesh_obj(std::string_view text, const std::string& name) {
  return Reader(text, name).read();
}

std::string hair_mesh_obj(const HairMesh& mesh) {
  fmt::memory_buffer out;
  const auto put = [&]<class... A>(fmt::format_string<A...> text, A&&... values) {
    fmt::format_to(std::back_inserter(out), text, std::forward<A>(values)...);
  };
  put("# Hair mesh: one object a layer, the scalp's first. Metres.\n");
  for (int k = 0; k < mesh.layers; ++k) {
    put("o layer_{}\n", k);
    for (const Vec3& point : mesh.layer(k)) put("v {} {} {}\n", point.x(), point.y(), point.z());
    for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
      if (!mesh.groups.empty() && (f == 0 || mesh.groups[f] != mesh.groups[f - 1]))
        put("g {}\n", group_word(mesh.group_names[mesh.groups[f]]));
      put("f");
      for (int c = 0; c < HairMesh::corners(mesh.faces[f]); ++c)
        put(" {}", mesh.faces[f][c] + 1 + static_cast<std::int64_t>(k * mesh.vertices()));
      put("\n");
    }
  }
  return fmt::to_string(out);
}

}  // namespace ringlet::groom
