#pragma once
/// Meshes with polygons as text, in the formats that hold them.
#include <string>
#include <vector>

#include "tactus/base/error.h"
#include "tactus/base/vec.h"

namespace tactus::test {

/// A number with all its digits.
inline std::string digits(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.17g", x);
  return text;
}

struct PolygonMesh {
  std::vector<Vec3d> vertices;
  std::vector<std::vector<int>> faces;  ///< from 0

  std::string vertex_lines(const std::string& key, const std::string& behind = "") const {
    std::string text;
    for (const Vec3d p : vertices)
      text += key + digits(p.x) + " " + digits(p.y) + " " + digits(p.z) + behind + "\n";
    return text;
  }
  std::string face_lines(bool with_size, int first) const {
    std::string text;
    for (const auto& face : faces) {
      text += with_size ? std::to_string(face.size()) : std::string("f");
      for (const int v : face) text += " " + std::to_string(v + first);
      text += "\n";
    }
    return text;
  }
  std::string counts() const {
    return std::to_string(vertices.size()) + " " + std::to_string(faces.size()) + " 0\n";
  }

  /// @param format .obj, .ply or .off
  std::string text(const std::string& format) const {
    if (format == ".obj") return vertex_lines("v ") + face_lines(false, 1);
    if (format == ".off") return "OFF\n" + counts() + vertex_lines("") + face_lines(true, 0);
    return "ply\nformat ascii 1.0\nelement vertex " + std::to_string(vertices.size()) +
           "\nproperty double x\nproperty double y\nproperty double z\nelement face " +
           std::to_string(faces.size()) + "\nproperty list uchar int vertex_indices\nend_header\n" +
           vertex_lines("") + face_lines(true, 0);
  }
  /// One solid of ASCII STL; its faces are triangles.
  std::string solid(const std::string& name) const {
    std::string text = "solid " + name + "\n";
    for (const auto& face : faces) {
      text += "  facet normal 0 0 0\n    outer loop\n";
      for (const int v : face) {
        const Vec3d p = vertices.at(static_cast<std::size_t>(v));
        text += "      vertex " + digits(p.x) + " " + digits(p.y) + " " + digits(p.z) + "\n";
      }
      text += "    endloop\n  endfacet\n";
    }
    return text + "endsolid " + name + "\n";
  }
};

/// A cube of triangles from `corner` on.
inline PolygonMesh triangle_cube(Vec3d corner, double edge) {
  PolygonMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.vertices.push_back(corner + edge * Vec3d{double(i & 1), double(i >> 1 & 1), double(i >> 2)});
  mesh.faces = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return mesh;
}

}  // namespace tactus::test
