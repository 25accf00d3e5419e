#include <bit>
#include <cstring>
#include <optional>

#include "tactus/base/error.h"
#include "tactus/io/mesh/mesh_reading.h"

namespace tactus::mesh_reading {
namespace {

enum class Type { i8, u8, i16, u16, i32, u32, f32, f64 };
enum class Format { ascii, little, big };

struct Property {
  std::string name;
  Type type{};
  std::optional<Type> count_type;  ///< of a list
};
struct Element {
  std::string name;
  std::int64_t count = 0;
  std::vector<Property> properties;
};
struct Header {
  Format format = Format::ascii;
  std::vector<Element> elements;
};

Type type_of(const LineReader& in, std::string_view name) {
  static constexpr std::pair<std::string_view, Type> kTypes[] = {
      {"char", Type::i8},   {"int8", Type::i8},     {"uchar", Type::u8},   {"uint8", Type::u8},
      {"short", Type::i16}, {"int16", Type::i16},   {"ushort", Type::u16}, {"uint16", Type::u16},
      {"int", Type::i32},   {"int32", Type::i32},   {"uint", Type::u32},   {"uint32", Type::u32},
      {"float", Type::f32}, {"float32", Type::f32}, {"double", Type::f64}, {"float64", Type::f64}};
  for (const auto& [n, type] : kTypes) {
    if (n == name) return type;
  }
  in.fail("unknown type '" + std::string(name) + "', expected such as float, uchar or int");
}

std::size_t size_of(Type type) {
  static constexpr std::size_t kSizes[] = {1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<std::size_t>(type)];
}

void read_property(const LineReader& in, Header& header) {
  const auto& w = in.words();
  if (header.elements.empty()) in.fail("a property before any element");
  Property property;
  if (w.size() == 5 && w[1] == "list") {
    property.count_type = type_of(in, w[2]);
    property.type = type_of(in, w[3]);
  } else if (w.size() == 3) {
    property.type = type_of(in, w[1]);
  } else {
    in.fail("expected 'property TYPE NAME' or 'property list TYPE TYPE NAME'");
  }
  property.name = w.back();
  header.elements.back().properties.push_back(property);
}

Header read_header(LineReader& in) {
  Header header;
  in.require("'ply'");
  if (lower_case(in.words()[0]) != "ply") in.fail("expected 'ply' at the start of the file");
  for (;;) {
    in.require("'end_header'");
    const auto& w = in.words();
    if (w[0] == "end_header") return header;
    if (w[0] == "format" && w.size() >= 2) {
      if (w[1] == "ascii") {
        header.format = Format::ascii;
      } else if (w[1] == "binary_little_endian") {
        header.format = Format::little;
      } else if (w[1] == "binary_big_endian") {
        header.format = Format::big;
      } else {
        in.fail("unknown format '" + std::string(w[1]) +
                "', expected ascii, binary_little_endian or binary_big_endian");
      }
    } else if (w[0] == "element" && w.size() == 3) {
      const std::int64_t count = in.integer(2);
      if (count < 0) in.fail("a negative number of elements");
      header.elements.push_back({std::string(w[1]), count, {}});
    } else if (w[0] == "property") {
      read_property(in, header);
    } else if (w[0] != "comment" && w[0] != "obj_info") {
      in.fail("'" + std::string(w[0]) + "', expected format, element, property, comment or end_header");
    }
  }
}

/// Values one after the other, from text or bytes.
class Values {
 public:
  Values(const std::string& path, LineReader& in, Format format)
      : path_(path), in_(in), format_(format), bytes_(in.rest()) {}

  void begin(const Element& element, std::int64_t index) {
    element_ = &element;
    index_ = index;
    word_ = 0;
    if (format_ == Format::ascii) in_.require(where() + " of " + std::to_string(element.count));
  }
  double next(Type type) {
    if (format_ == Format::ascii) return in_.number(word_++);
    const std::size_t n = size_of(type);
    if (bytes_.size() < n)
      throw Error(path_ + ": truncated in " + where() + " of " + std::to_string(element_->count));
    std::uint64_t raw = 0;  // its first bytes in memory are the value
    for (std::size_t k = 0; k < n; ++k) {
      const std::size_t place = format_ == Format::big ? n - 1 - k : k;
      raw |= std::uint64_t{static_cast<unsigned char>(bytes_[k])} << (8 * place);
    }
    bytes_.remove_prefix(n);
    switch (type) {
      case Type::i8:
        return load<std::int8_t>(raw);
      case Type::u8:
        return load<std::uint8_t>(raw);
      case Type::i16:
        return load<std::int16_t>(raw);
      case Type::u16:
        return load<std::uint16_t>(raw);
      case Type::i32:
        return load<std::int32_t>(raw);
      case Type::u32:
        return load<std::uint32_t>(raw);
      case Type::f32:
        return static_cast<double>(load<float>(raw));
      case Type::f64:
        return load<double>(raw);
    }
    return 0;
  }
  std::int64_t integer(Type type) {
    const double value = next(type);
    if (!(value >= -9e15 && value <= 9e15) || value != static_cast<double>(static_cast<std::int64_t>(value)))
      throw Error(path_ + ": " + where() + " holds " + std::to_string(value) + ", expected a whole number");
    return static_cast<std::int64_t>(value);
  }
  std::int64_t list_size(const Property& property) {
    const std::int64_t n = integer(*property.count_type);
    if (n < 0)  // how many there are bounds the file: no value takes no byte
      throw Error(path_ + ": " + where() + " has a list of " + std::to_string(n) + " values");
    return n;
  }
  std::string where() const { return element_->name + " " + std::to_string(index_); }

 private:
  template <class T>
  static T load(std::uint64_t raw) {
    static_assert(std::endian::native == std::endian::little);
    T value;
    std::memcpy(&value, &raw, sizeof value);
    return value;
  }
  const std::string& path_;
  LineReader& in_;
  Format format_;
  std::string_view bytes_;
  const Element* element_ = nullptr;
  std::int64_t index_ = 0;
  std::size_t word_ = 0;
};

void read_vertices(const std::string& path, const Element& element, Values& values, const LineReader& in,
                   Format format, RawMesh& raw) {
  static const std::string kNames[] = {"x", "y", "z", "nx", "ny", "nz"};
  std::vector<int> target(element.properties.size(), -1);
  unsigned found = 0;
  for (std::size_t p = 0; p < target.size(); ++p) {
    for (int k = 0; k < 6; ++k) {
      if (element.properties[p].name != kNames[k] || element.properties[p].count_type) continue;
      target[p] = k;
      found |= 1U << k;
    }
  }
  if ((found & 7U) != 7U) throw Error(path + ": element 'vertex' lacks the properties x, y and z");
  for (std::int64_t i = 0; i < element.count; ++i) {
    values.begin(element, i);
    double v[6] = {};
    for (std::size_t p = 0; p < target.size(); ++p) {
      const Property& property = element.properties[p];
      const std::int64_t n = property.count_type ? values.list_size(property) : 1;
      for (std::int64_t k = 0; k < n; ++k) {
        const double value = values.next(property.type);
        if (target[p] >= 0) v[target[p]] = value;
      }
    }
    raw.add_vertex({v[0], v[1], v[2]});
    if (found == 63U) raw.normals.push_back(vec_cast<float>(Vec3d{v[3], v[4], v[5]}));
    if (format == Format::ascii) raw.lines.push_back(in.line());
  }
}

/// Faces and strips of triangles; the values of any other element are read past.
void read_faces(const Element& element, Values& values, RawMesh& raw) {
  const bool strips = element.name == "tristrips", faces = strips || element.name == "face";
  std::vector<std::int64_t> corners;
  for (std::int64_t i = 0; i < element.count && !element.properties.empty(); ++i) {
    values.begin(element, i);
    for (const Property& property : element.properties) {
      const bool indices = faces && (property.name == "vertex_indices" || property.name == "vertex_index");
      const std::int64_t n = property.count_type ? values.list_size(property) : 1;
      corners.clear();
      for (std::int64_t k = 0; k < n; ++k) {
        if (indices) {
          corners.push_back(values.integer(property.type));
        } else {
          values.next(property.type);
        }
      }
      if (indices && strips) raw.add_strip(corners, i);
      if (indices && !strips) raw.add_face(corners, i);
    }
  }
}

}  // namespace

RawMesh read_ply(const std::string& path, const std::string& bytes) {
  const PlainText text(bytes);
  LineReader in(path, text.view());
  const Header header = read_header(in);
  Values values(path, in, header.format);
  RawMesh raw;
  bool vertices = false;
  for (const Element& element : header.elements) {
    if (element.name == "vertex") {
      read_vertices(path, element, values, in, header.format, raw);
      vertices = true;
    } else {
      read_faces(element, values, raw);
    }
  }
  if (!vertices) throw Error(path + ": no element 'vertex' in the header");
  return raw;
}

}  // namespace tactus::mesh_reading
