#pragma once
/// The sinks of `tactus run`, and single pictures, for programs of your own.
#include <memory>
#include <string>

#include "tactus/run/frame_loop.h"

namespace tactus {

// STEM is the beginning of file names: "out/demo". Files are whole or not there.

/// The film STEM.mp4 and the sheet STEM.png, as the scene's `output` and `view` say; drawn on another thread.
/// @param frames_per_s of the film @throws Error without OpenGL 4.5, or when the folder can't be written.
std::unique_ptr<FrameSink> make_picture_sink(const Scene& scene, const Rig& rig, const BodyAssets& assets,
                                             World& world, const std::string& stem, double frames_per_s);
/// Surfaces of every `output.mesh_every`-th frame: STEM-real-00012.ply, STEM-BODY-00012.ply,
/// STEM-liquid-00012.ply.
std::unique_ptr<FrameSink> make_mesh_sink(const Scene& scene, const std::string& stem);
/// For ParaView, every so many frames: nodes and strains of bodies in STEM-BODY-00012.vtu, surfaces and
/// particles in .vtp, and STEM.pvd, which plays them.
std::unique_ptr<FrameSink> make_vtk_sink(int every, const std::string& stem);
/// All that is seen, every `output.usd_every` frames, in STEM.usda.
std::unique_ptr<FrameSink> make_usd_sink(const Scene& scene, const BodyAssets& assets,
                                         const std::string& stem, double frames_per_s);
/// The results of all frames as JSON (docs/results.md), in a file. Keeps references to both.
std::unique_ptr<FrameSink> make_json_sink(const Scene& scene, const FrameLoop& loop, World& world,
                                          const std::string& path);
/// Leaves out work where frames take longer than a time: the last sink, as it measures the others, too.
/// `world` needs a Perception that can be reduced. Keeps a reference.
std::unique_ptr<FrameSink> make_budget_sink(double budget_s, World& world);
/// One line at the terminal: the frame's number and the time left.
std::unique_ptr<FrameSink> make_progress_sink();
/// A line for each stretch of frames in which a body is strained badly.
std::unique_ptr<FrameSink> make_explain_sink(const Scene& scene);

/// A world as it is now, as the scene's `view` looks at it, without photographs. @throws Error without OpenGL
/// 4.5, or for a size that it can't draw.
ColorImage picture_of(World& world, Scene scene, const Rig& rig, const BodyAssets& assets);

}  // namespace tactus
