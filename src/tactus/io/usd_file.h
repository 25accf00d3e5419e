#pragma once
/// Surfaces that move, as one text file of Universal Scene Description (.usda): Blender, Omniverse and
/// usdview play it.
#include <cstdio>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "tactus/geom/mesh/mesh.h"

namespace tactus {

/// Collects frames in temporary files without names, so memory doesn't grow with a run, and a run that is
/// killed leaves nothing. SI units, +Y up; one time code a frame.
///
///   UsdWriter usd("out/touch.usda", 60);
///   per frame: usd.add("slab", mesh, colour, time_code); usd.end_frame(time_code);
///   usd.write();
class UsdWriter {
 public:
  /// @param frames_per_s of time codes
  UsdWriter(std::string path, double frames_per_s) : path_(std::move(path)), rate_(frames_per_s) {}

  /// A surface at a time code. Where triangles are those of the frame before, they are not repeated.
  /// Velocities [m/s] are of vertices that were there in the frame before; else they are 0.
  /// @param name what it is called in all frames. Signs that USD's names don't have become _, and another
  /// thing of the same name then gets one more @param colour sRGB, 0..1
  /// @throws Error when the disk is full.
  void add(const std::string& name, const TriangleMesh& mesh, Vec3f colour, int time_code);
  /// Particles of a liquid at a time code. @param width_m diameter
  void add_points(const std::string& name, std::span<const Vec3f> x_m, float width_m, Vec3f colour,
                  int time_code);
  /// A surface that stands still.
  void add_still(const std::string& name, const TriangleMesh& mesh, Vec3f colour) {
    add(name, mesh, colour, 0);
    prims_.back()->is_still = true;
  }
  /// What moved, and wasn't added in this frame, isn't there any more.
  void end_frame(int time_code);
  /// @throws Error naming the path.
  void write() const;

 private:
  struct FileCloser {
    void operator()(std::FILE* f) const { std::fclose(f); }
  };
  using Scratch = std::unique_ptr<std::FILE, FileCloser>;
  /// An attribute: its time samples so far.
  struct Samples {
    std::string declaration;  ///< "point3f[] points"
    Scratch file;
  };
  struct Prim {
    std::string name, id;  ///< as given, and in the file
    std::string kind;
    Vec3f colour;
    float width_m = 0;
    std::vector<Samples> attributes;
    TriangleMesh last;   ///< its frame before
    int last_code = -2;  ///< of its newest sample
    bool is_still = false, is_gone = false;
  };
  Prim& prim(const std::string& name, const char* kind, std::initializer_list<const char*> declarations);
  void sample(Prim& of, std::size_t attribute, int time_code, const std::string& value) const;
  static std::string head_of(const Prim& of);

  std::string path_;
  double rate_;
  int last_ = 0;
  std::vector<std::unique_ptr<Prim>> prims_;
};

}  // namespace tactus
