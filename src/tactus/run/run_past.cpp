#include "tactus/run/run_past.h"

#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/base/timing.h"

namespace tactus {

RunProgress take_up(const PastState& from, FrameSource& source, World& world, const std::string& named) {
  const std::optional<FrameSet> last = take_again(source, from.progress.taken, named);
  world.load_state(from.bytes, last ? &*last : nullptr);
  return from.progress;
}

std::string StateSaver::why_not() const {
  const std::lock_guard lock(mutex_);
  return why_not_;
}

std::shared_ptr<const PastState> StateSaver::save(World& world, const RunProgress& progress, int number,
                                                  bool at_once) {
  const double begin_s = now_s();
  if (!why_not().empty() || (begin_s < due_s_ && !at_once)) return nullptr;
  try {
    auto state = std::make_shared<const PastState>(PastState{world.save_state(), progress, number});
    const double end_s = now_s();
    due_s_ = end_s + 9 * (end_s - begin_s);
    return state;
  } catch (const Error& error) {  // a tool that is tracked, say: the run goes on
    log_warning(error.what());
    const std::lock_guard lock(mutex_);
    why_not_ = error.what();
    return nullptr;
  }
}

}  // namespace tactus
