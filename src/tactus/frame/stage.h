#pragma once
/// Stages: the work of a frame, as solvers declare it. A Schedule (schedule.h) puts them in order.
#include <functional>
#include <string>
#include <vector>

namespace tactus {

/// Something that stages read and write: "real surface/samples". Two stages that name it are ordered by it.
using Resource = std::string;

/// When a stage runs. Stages of one rate make one recording.
enum class Rate {
  upload,   ///< when new images came; never recorded, since its sources change
  capture,  ///< when new images came: the reconstruction from them
  before,   ///< once before a frame's substeps, when it has any
  substep,  ///< in every substep, or in every `every`-th
  ahead,    ///< once for each paced step, beside the substeps before it: on a GPU, they run at the same time
  paced,    ///< in steps of its own: as many as the frame asks for, spread evenly over its substeps
  after,    ///< once after a frame's substeps, when it has any
  end,      ///< at the end of every frame
};
inline constexpr int kRates = 8;
const char* rate_text(Rate rate);

/// Which devices of the set a stage submits to. A stage for all of them orders its own parts.
enum class StageDevices { first, all };

/// Where in a block of substeps that are recorded together a stage runs. Other rates: substep 0 of 1.
struct BlockPlace {
  int substep = 0, count = 1;
};

/// Work that is submitted together.
struct Stage {
  std::string name;      ///< unique: "contact/correct"
  std::string timed_as;  ///< the row of the report in which its time counts: "bodies"
  Rate rate = Rate::end;
  int every = 1;   ///< rate substep: it runs in substeps 0, every, 2 every, ...
  int period = 1;  ///< rate substep: its submissions repeat after so many substeps
  StageDevices devices = StageDevices::first;
  // Stages of one rate run in this order for each resource: those that read its value of the last frame or
  // substep, those that write it, those that update it (in the order in which they were added), those that
  // read it.
  std::vector<Resource> reads_last = {}, writes = {}, updates = {}, reads = {};
  std::function<void(BlockPlace)> submit;  ///< asynchronous; allocates nothing, reads nothing back
};

}  // namespace tactus
