#pragma once
/// Files of single frames.
#include "tactus/io/vtk_file.h"
#include "tactus/run/frame_sink.h"
#include "tactus/sim/scene.h"

namespace tactus {

/// Every so many frames (`output.mesh_every`) the surfaces: STEM-real-00012.ply, STEM-BODY-00012.ply and
/// STEM-liquid-00012.ply.
class MeshSink final : public FrameSink {
 public:
  MeshSink(const Scene& scene, const std::string& stem) : scene_(scene), stem_(stem) {}
  /// None of a frame whose real surface is open. @throws Error when a file can't be written.
  void frame(RunFrame& frame) override;

 private:
  Scene scene_;
  std::string stem_;
};

/// Every so many frames (`output.vtk_every`) for ParaView: positions, velocities and strains of each body's
/// nodes in STEM-BODY-00012.vtu, STEM-real-00012.vtp and STEM-liquid-00012.vtp, and STEM.pvd, which plays all
/// frames so far.
class VtkSink final : public FrameSink {
 public:
  VtkSink(int every, const std::string& stem) : every_(every), stem_(stem) {}
  /// @throws Error when a file can't be written.
  void frame(RunFrame& frame) override;

 private:
  std::string add(const RunFrame& frame, const std::string& part, const char* extension);

  int every_;
  std::string stem_;
  std::vector<TimedFile> files_;
};

}  // namespace tactus
