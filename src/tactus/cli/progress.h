#pragma once
/// The line that tells how far a run is.
#include <optional>
#include <string>

namespace tactus {

/// "frame 30 of 120, 12 s left". @param total frames, where that is known @param elapsed_s for those done
std::string progress_text(int done, std::optional<int> total, double elapsed_s);

}  // namespace tactus
