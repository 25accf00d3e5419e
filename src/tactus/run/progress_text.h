#pragma once
/// How far a run is, and the time that a frame took, for people.
#include <optional>
#include <string>

#include "tactus/run/frame_sink.h"

namespace tactus {

/// "frame 30 of 120, 12 s left". @param total frames, where that is known @param elapsed_s for those done
std::string progress_text(int done, std::optional<int> total, double elapsed_s);
/// "hull 0.9 ms   mesh 0.3 ms   bodies 4.1 ms (31 substeps)   frame 5.6 ms"
std::string times_text(const RunFrame& frame);
/// The same after its number: "frame 12   hull 0.9 ms ..."
std::string caption_text(const RunFrame& frame);

}  // namespace tactus
