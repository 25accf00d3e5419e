#include "tactus/window/rig_checkup.h"

#include <sys/resource.h>
#include <tbb/task_arena.h>

#include "tactus/base/error.h"
#include "tactus/rig/rig_file.h"

namespace tactus {
namespace {

bool is_filmed(SourceKind kind) { return kind != SourceKind::none && kind != SourceKind::synthetic; }

bool has_rig_file(SourceKind kind) {
  return kind == SourceKind::masks || kind == SourceKind::videos || kind == SourceKind::live;
}

}  // namespace

RigCheckup::RigCheckup(const SourceDescription& source, std::function<void()> done)
    : source_(source), done_(std::move(done)), state_(is_filmed(source.kind) ? State::waiting : State::off) {}

RigCheckup::~RigCheckup() {
  if (thread_.joinable()) thread_.join();
}

RigCheckup::State RigCheckup::state() const {
  const std::lock_guard lock(mutex_);
  return state_;
}

std::shared_ptr<const RigCheckup::Result> RigCheckup::result() const {
  const std::lock_guard lock(mutex_);
  return result_;
}

void RigCheckup::add(const Rig& rig, const std::vector<BitMask>& silhouettes) {
  if (state() != State::waiting) return;
  if (input_.ticks.empty()) {
    input_.cameras = rig.cameras;
    input_.workspace_m = rig.workspace_m;
  }
  input_.ticks.push_back(silhouettes);
  if (input_.ticks.size() == kSets) begin();
}

void RigCheckup::begin() {
  const std::lock_guard lock(mutex_);
  if (state_ != State::waiting || input_.ticks.empty()) return;
  state_ = State::looking;
  thread_ = std::thread([this] { examine(); });
}

void RigCheckup::examine() noexcept {
  setpriority(PRIO_PROCESS, 0, 19);  // of this thread alone, on Linux
  auto result = std::make_shared<Result>();
  try {
    if (has_rig_file(source_.kind)) input_.R_file_world = read_rig_file(source_.path).R_file_world;
    tbb::task_arena alone(1);  // the physics has the other cores
    alone.execute([&] { result->diagnosis = examine_rig(input_); });
  } catch (const std::exception& error) {
    result->error = error.what();
  }
  input_ = {};
  {
    const std::lock_guard lock(mutex_);
    result_ = std::move(result);
    state_ = State::done;
  }
  if (done_) done_();
}

}  // namespace tactus
