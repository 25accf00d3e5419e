#include "tactus/io/usd_file.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstring>

#include "tactus/base/error.h"
#include "tactus/base/safe_file.h"

namespace tactus {
namespace {

/// The attributes of a mesh and of particles, in the order in which they are declared.
enum MeshAttribute : std::size_t { kPoints, kVelocities, kExtent, kCounts, kIndices };

void add(std::string& text, Vec3f v) {
  char item[64];
  std::snprintf(item, sizeof item, "%s(%.9g, %.9g, %.9g)", text.size() > 1 ? ", " : "", double{v.x},
                double{v.y}, double{v.z});
  text += item;
}

std::string list_of(std::span<const Vec3f> all) {
  std::string text = "[";
  for (const Vec3f& v : all) add(text, v);
  return text + "]";
}

std::string extent_of(std::span<const Vec3f> all, float around_m = 0) {
  if (all.empty()) return "[(0, 0, 0), (0, 0, 0)]";
  Vec3f low = all.front(), high = low;
  for (const Vec3f& v : all) low = min(low, v), high = max(high, v);
  const Vec3f around{around_m, around_m, around_m};
  return list_of(std::array{low - around, high + around});
}

/// A name as USD takes it.
std::string identifier(const std::string& name) {
  std::string id = name;
  for (char& c : id)
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
  if (id.empty() || std::isdigit(static_cast<unsigned char>(id.front())) != 0) id.insert(0, "_");
  return id;
}

/// sRGB to the linear colour that USD's displayColor is.
float linear(float c) { return c <= 0.04045F ? c / 12.92F : std::pow((c + 0.055F) / 1.055F, 2.4F); }

}  // namespace

UsdWriter::Prim& UsdWriter::prim(const std::string& name, const char* kind,
                                 std::initializer_list<const char*> declarations) {
  for (const auto& known : prims_)
    if (known->name == name) return *known;
  auto made = std::make_unique<Prim>();
  made->name = name;
  made->id = identifier(name);
  const auto is_taken = [&](const auto& other) { return other->id == made->id; };
  while (std::any_of(prims_.begin(), prims_.end(), is_taken)) made->id += '_';
  made->kind = kind;
  for (const char* declaration : declarations) {
    made->attributes.push_back({declaration, Scratch(std::tmpfile())});
    if (made->attributes.back().file == nullptr)
      throw Error(path_ + ": no temporary file: " + std::strerror(errno));
  }
  return *prims_.emplace_back(std::move(made));
}

void UsdWriter::sample(Prim& of, std::size_t attribute, int time_code, const std::string& value) const {
  std::FILE* file = of.attributes.at(attribute).file.get();
  if (std::fprintf(file, "            %d: %s,\n", time_code, value.c_str()) < 0 || std::fflush(file) != 0)
    throw Error(path_ + ": its temporary file: " + std::strerror(errno));
}

void UsdWriter::add(const std::string& name, const TriangleMesh& mesh, Vec3f colour, int time_code) {
  Prim& p = prim(name, "Mesh",
                 {"point3f[] points", "vector3f[] velocities", "float3[] extent", "int[] faceVertexCounts",
                  "int[] faceVertexIndices"});
  p.colour = colour;
  const bool same = p.last_code == time_code - 1 && p.last.triangles == mesh.triangles &&
                    p.last.positions_m.size() == mesh.positions_m.size();
  std::vector<Vec3f> velocities_m_s(mesh.positions_m.size());
  if (same) {
    for (std::size_t i = 0; i < velocities_m_s.size(); ++i)
      velocities_m_s[i] = static_cast<float>(rate_) * (mesh.positions_m[i] - p.last.positions_m[i]);
  } else {
    std::string counts = "[", indices = "[";
    for (const auto& t : mesh.triangles) {
      counts += counts.size() > 1 ? ", 3" : "3";
      for (const Index i : t) indices += (indices.size() > 1 ? ", " : "") + std::to_string(i);
    }
    sample(p, kCounts, time_code, counts + "]");
    sample(p, kIndices, time_code, indices + "]");
  }
  sample(p, kPoints, time_code, list_of(mesh.positions_m));
  sample(p, kVelocities, time_code, list_of(velocities_m_s));
  sample(p, kExtent, time_code, extent_of(mesh.positions_m));
  p.last = mesh;
  p.last_code = time_code;
  p.is_gone = false;
}

void UsdWriter::add_points(const std::string& name, std::span<const Vec3f> x_m, float width_m, Vec3f colour,
                           int time_code) {
  Prim& p = prim(name, "Points", {"point3f[] points", "float3[] extent"});
  p.colour = colour;
  p.width_m = width_m;
  sample(p, 0, time_code, list_of(x_m));
  sample(p, 1, time_code, extent_of(x_m, width_m / 2));
  p.last_code = time_code;
}

void UsdWriter::end_frame(int time_code) {
  last_ = time_code;
  for (const auto& p : prims_) {
    if (p->is_still || p->is_gone || p->last_code == time_code || p->kind != "Mesh") continue;
    add(p->name, {}, p->colour, time_code);
    p->is_gone = true;
  }
}

std::string UsdWriter::head_of(const Prim& of) {
  const Vec3f c{linear(of.colour.x), linear(of.colour.y), linear(of.colour.z)};
  std::string text = "    def " + of.kind + " \"" + of.id + "\"\n    {\n";
  if (of.kind == "Mesh") {
    text += "        uniform token subdivisionScheme = \"none\"\n        uniform bool doubleSided = true\n";
  } else {
    char width[128];
    std::snprintf(width, sizeof width,
                  "        float[] widths = [%.9g] (\n            interpolation = \"constant\"\n        )\n",
                  double{of.width_m});
    text += width;
  }
  return text + "        color3f[] primvars:displayColor = " + list_of(std::span(&c, 1)) + "\n";
}

void UsdWriter::write() const {
  SafeFile file(path_);
  char head[256];
  std::snprintf(head, sizeof head,
                "#usda 1.0\n(\n    defaultPrim = \"World\"\n    doc = \"Tactus\"\n    endTimeCode = %d\n"
                "    metersPerUnit = 1\n    startTimeCode = 0\n    timeCodesPerSecond = %.17g\n"
                "    upAxis = \"Y\"\n)\n\ndef Xform \"World\"\n{\n",
                last_, rate_);
  file.write(head);
  std::vector<char> buffer(1 << 16);
  for (const auto& p : prims_) {
    file.write(head_of(*p));
    for (const Samples& samples : p->attributes) {
      file.write("        " + samples.declaration + ".timeSamples = {\n");
      std::rewind(samples.file.get());
      while (const std::size_t n = std::fread(buffer.data(), 1, buffer.size(), samples.file.get()))
        file.write(buffer.data(), n);
      file.write("        }\n");
    }
    file.write("    }\n");
  }
  file.write("}\n");
  file.commit();
}

}  // namespace tactus
