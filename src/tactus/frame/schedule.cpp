#include "tactus/frame/schedule.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <set>

#include "tactus/base/error.h"

namespace tactus {
namespace {

constexpr Rate kAllRates[] = {Rate::upload, Rate::capture, Rate::before, Rate::substep,
                              Rate::ahead,  Rate::paced,   Rate::after,  Rate::end};

bool names(const std::vector<Resource>& resources, const Resource& resource) {
  return std::find(resources.begin(), resources.end(), resource) != resources.end();
}

std::string list_text(const char* head, const std::vector<Resource>& resources) {
  std::string text;
  for (const Resource& r : resources) text += (text.empty() ? std::string(head) + " " : ", ") + r;
  return text.empty() ? "" : "  " + text;
}

/// The first number of units after which paced step k of `paced` is due.
int units_before(int k, int units, int paced) {
  return static_cast<int>((static_cast<std::int64_t>(k + 1) * units + paced - 1) / paced);
}

}  // namespace

const char* rate_text(Rate rate) {
  switch (rate) {
    case Rate::upload:
      return "new images: upload";
    case Rate::capture:
      return "new images: reconstruct";
    case Rate::before:
      return "before the substeps";
    case Rate::substep:
      return "every substep";
    case Rate::ahead:
      return "ahead of steps of their own, beside substeps";
    case Rate::paced:
      return "steps of their own, among the substeps";
    case Rate::after:
      return "after the substeps";
    case Rate::end:
      return "end of every frame";
  }
  return "";
}

Schedule::Schedule(DeviceSet& devices)
    : devices_(devices),
      frame_(devices),
      paced_frame_(devices),
      forked_(static_cast<std::size_t>(devices.count())) {
  if (devices.is_cuda()) side_stream_ = std::make_unique<SideStream>(devices.context(0).device());
  recordings_.push_back(std::make_unique<Recording>());
}

void Schedule::add(Stage stage) {
  if (closed_) throw Error("stage '" + stage.name + "': the schedule is closed");
  for (const Stage& other : stages_) {
    if (other.name == stage.name) throw Error("two stages are named '" + stage.name + "'");
  }
  stages_.push_back(std::move(stage));
}

void Schedule::close() {
  closed_ = true;
  unit_ = 1;
  std::set<Resource> known;
  for (const Stage& stage : stages_) {
    if (stage.rate == Rate::substep) unit_ = std::lcm(unit_, std::lcm(stage.every, stage.period));
    known.insert(stage.writes.begin(), stage.writes.end());
    known.insert(stage.updates.begin(), stage.updates.end());
  }
  for (const Stage& stage : stages_) {
    for (const auto* list : {&stage.reads_last, &stage.reads}) {
      for (const Resource& r : *list) {
        if (!known.contains(r))
          throw Error("stage '" + stage.name + "' reads '" + r + "', which no stage writes");
      }
    }
  }
  const After after = find_edges();
  crosses_.assign(stages_.size(), 0);
  // Substeps follow one another, so a stage also waits for those that come after it in the last substep.
  for (std::size_t i = 0; i < stages_.size(); ++i) {
    for (const std::size_t before : after[i]) {
      if (stages_[before].devices != stages_[i].devices) crosses_[i] = crosses_[before] = 1;
    }
  }
  for (const Rate rate : kAllRates) order(rate, after);
  std::vector<Group>& groups = segment(Rate::substep).groups;
  if (groups.size() < 2) return;
  for (Group& group : groups) {
    group.begins.resize(static_cast<std::size_t>(unit_));
    group.ends.resize(static_cast<std::size_t>(unit_));
  }
}

Schedule::After Schedule::find_edges() const {
  After after(stages_.size());
  std::set<Resource> resources;
  for (const Stage& s : stages_) {
    for (const auto* list : {&s.reads_last, &s.writes, &s.updates, &s.reads})
      resources.insert(list->begin(), list->end());
  }
  for (const Resource& r : resources) add_edges_of(r, after);
  return after;
}

void Schedule::add_edges_of(const Resource& resource, After& after) const {
  const auto rank = [&](const Stage& s) {
    if (names(s.reads_last, resource)) return 0;
    if (names(s.writes, resource)) return 1;
    if (names(s.updates, resource)) return 2;
    return names(s.reads, resource) ? 3 : -1;
  };
  for (std::size_t a = 0; a < stages_.size(); ++a) {
    for (std::size_t b = 0; b < stages_.size(); ++b) {
      const int first = rank(stages_[a]), second = rank(stages_[b]);
      if (a == b || first < 0 || second < 0 || stages_[a].rate != stages_[b].rate) continue;
      const bool updates_in_turn = first == 2 && second == 2 && a < b;
      if (first < second || updates_in_turn) after[b].push_back(a);
    }
  }
}

/// Where several stages could come next, the one that was added first does.
void Schedule::order(Rate rate, const After& after) {
  Segment& ordered = segment(rate);
  ordered.groups.clear();
  std::vector<char> done(stages_.size());
  const auto waits = [&](std::size_t i) {
    return std::any_of(after[i].begin(), after[i].end(),
                       [&](std::size_t before) { return done[before] == 0; });
  };
  for (;;) {
    std::size_t next = stages_.size();
    std::string blocked;
    for (std::size_t i = 0; i < stages_.size() && next == stages_.size(); ++i) {
      if (stages_[i].rate != rate || done[i] != 0) continue;
      if (!waits(i))
        next = i;
      else
        blocked += (blocked.empty() ? "'" : ", '") + stages_[i].name + "'";
    }
    if (next == stages_.size()) {
      if (!blocked.empty()) throw Error("the stages " + blocked + " wait for one another");
      return;
    }
    done[next] = 1;
    if (ordered.groups.empty() || ordered.groups.back().timed_as != stages_[next].timed_as) {
      ordered.groups.emplace_back();
      ordered.groups.back().timed_as = stages_[next].timed_as;
    }
    ordered.groups.back().stages.push_back(next);
  }
}

/// The other devices wait for all work that the first was given so far.
void Schedule::wait_for_first() {
  devices_.context(0).record(forked_[0]);
  for (int p = 1; p < devices_.count(); ++p) devices_.context(p).wait(forked_[0]);
}

/// The first device waits for all work that the others were given so far.
void Schedule::wait_for_all() {
  for (int p = 1; p < devices_.count(); ++p) {
    Event& event = forked_[static_cast<std::size_t>(p)];
    devices_.context(p).record(event);
    devices_.context(0).wait(event);
  }
}

void Schedule::submit_stage(std::size_t stage, BlockPlace place) {
  if (crosses_[stage] != 0 && devices_.count() > 1) {
    if (stages_[stage].devices == StageDevices::all)
      wait_for_first();
    else
      wait_for_all();
  }
  stages_[stage].submit(place);
}

void Schedule::submit_groups(Segment& s) {
  ExecContext& first = devices_.context(0);
  for (Group& group : s.groups) {
    group.begin.take(first);
    for (const std::size_t stage : group.stages) submit_stage(stage, {});
    if (&group == &s.groups.back() && devices_.count() > 1) wait_for_all();
    group.end.take(first);
    group.ran = true;
  }
}

void Schedule::submit_block(int units) {
  const int count = units * unit_;
  for (int k = 0; k < count; ++k) submit_substep({k, count});
  frame_.end_block(count);
}

void Schedule::submit_substep(BlockPlace place) {
  const auto k = static_cast<std::size_t>(place.substep);
  for (Group& group : segment(Rate::substep).groups) {
    const bool is_timed = k < group.begins.size();
    if (is_timed) group.begins[k].take(devices_.context(0));
    for (const std::size_t stage : group.stages)
      if (place.substep % stages_[stage].every == 0) submit_stage(stage, place);
    if (is_timed) group.ends[k].take(devices_.context(0));
  }
}

/// How the time of the substeps divides among its groups, as it did in one unit.
std::vector<double> Schedule::substep_shares() const {
  const std::vector<Group>& groups = segment(Rate::substep).groups;
  std::vector<double> shares;
  double sum_s = 0;
  for (const Group& group : groups) {
    double seconds = 0;
    for (std::size_t k = 0; k < group.begins.size(); ++k)
      seconds += group.ends[k].seconds_since(group.begins[k]);
    shares.push_back(seconds);
    sum_s += seconds;
  }
  for (double& share : shares) share = sum_s > 0 ? share / sum_s : 1 / static_cast<double>(groups.size());
  return shares;
}

bool Schedule::replays() const {
  return devices_.is_cuda() && recording().is_made && !is_profiling(devices_);
}

void Schedule::record() {
  for (const Rate rate : {Rate::capture, Rate::before, Rate::after, Rate::end}) {
    Segment& s = segment(rate);
    if (!s.groups.empty()) graph(rate).record(devices_, [&] { submit_groups(s); });
  }
  if (!segment(Rate::substep).groups.empty() || !segment(Rate::paced).groups.empty()) {
    for (std::size_t b = 0; b < kBlocks; ++b)
      recording().blocks[b].record(devices_, [&] { submit_block(1 << b); });
  }
  // To record a group is not to run it, and a group that this frame leaves out has no times.
  for (const Rate rate : kAllRates) {
    for (Group& group : segment(rate).groups) group.ran = false;
  }
  recording().is_made = true;
}

void Schedule::record_paced() {
  auto& steps = recording().paced;
  if (segment(Rate::paced).groups.empty()) return;
  if (steps.size() <= variant_) steps.resize(variant_ + 1);
  if (steps[variant_]) return;
  steps[variant_] = std::make_unique<PacedStep>();
  const auto record = [&](Rate rate, DeviceGraph& graph) {
    Segment& s = segment(rate);
    if (!s.groups.empty()) graph.record(devices_, [&] { submit_groups(s); });
    for (Group& group : s.groups) group.ran = false;
  };
  record(Rate::ahead, steps[variant_]->ahead);
  record(Rate::paced, steps[variant_]->step);
}

void Schedule::record_anew() {
  for (auto& made : recordings_)
    if (made) made->is_made = false, made->paced.clear();
  ++made_;
}

void Schedule::clear() {
  stages_.clear();
  crosses_.clear();
  segments_ = {};
  for (auto& made : recordings_)
    if (made) made = std::make_unique<Recording>();
  closed_ = ran_whole_ = ran_substeps_ = false;
  ++made_;
}

void Schedule::select(std::size_t choice) {
  choice_ = choice;
  if (recordings_.size() <= choice) recordings_.resize(choice + 1);
  if (recordings_[choice]) return;
  recordings_[choice] = std::make_unique<Recording>();
  ran_whole_ = false;
  ++made_;
}

void Schedule::run_segment(Rate rate) {
  Segment& s = segment(rate);
  if (s.groups.empty()) return;
  if (replays() && rate != Rate::upload && rate != Rate::ahead && rate != Rate::paced) {
    graph(rate).launch(devices_);
    for (Group& group : s.groups) group.ran = true;
    return;
  }
  if (devices_.count() > 1) wait_for_first();
  submit_groups(s);
  if (devices_.count() > 1) wait_for_first();
}

void Schedule::run_substeps(int substeps, int paced) {
  paced_ = segment(Rate::paced).groups.empty() ? 0 : paced;
  if (segment(Rate::substep).groups.empty() && paced_ == 0) return;
  if (substeps % unit_ != 0)
    throw Error(std::to_string(substeps) + " substeps, expected a multiple of " + std::to_string(unit_));
  substeps_begin_.take(devices_.context(0));
  const int units = substeps / unit_;
  for (int k = 0, done = 0; done < units || k < paced_; ++k) {
    const bool is_step = k < paced_;
    const int next = is_step ? units_before(k, units, paced_) : units;
    if (is_step) begin_paced();
    run_units(next - done);
    if (is_step) run_paced();
    done = next;
  }
  substeps_end_.take(devices_.context(0));
  ran_substeps_ = true;
}

Schedule::PacedStep* Schedule::recorded_step() {
  const auto& steps = recording().paced;
  return replays() && variant_ < steps.size() ? steps[variant_].get() : nullptr;
}

/// What a paced step needs ahead. In replay, it runs beside the substeps that are submitted next.
void Schedule::begin_paced() {
  PacedStep* recorded = recorded_step();
  if (recorded == nullptr) return run_segment(Rate::ahead);
  if (!recorded->ahead.is_recorded()) return;
  recorded->ahead.launch_on(side_stream_->follow(devices_.context(0)));
  runs_beside_ = true;
}

void Schedule::run_paced() {
  PacedStep* recorded = recorded_step();
  if (recorded == nullptr) return run_segment(Rate::paced);
  if (std::exchange(runs_beside_, false)) side_stream_->join(devices_.context(0));
  recorded->step.launch(devices_);
  for (Group& group : segment(Rate::paced).groups) group.ran = true;
}

void Schedule::run_units(int units) {
  for (std::size_t b = kBlocks; b-- > 0;) {
    for (const int block = 1 << b; units >= block; units -= block) {
      if (replays()) {
        recording().blocks[b].launch(devices_);
        continue;
      }
      if (devices_.count() > 1) wait_for_first();
      submit_block(block);
      if (devices_.count() > 1) wait_for_all();
    }
  }
}

void Schedule::run(const FrameParams& params, bool has_new_images, PacedSteps paced) {
  begin_s_ = now_s();
  frame_.begin(params);
  if (!segment(Rate::paced).groups.empty()) {
    FrameParams own = params;
    own.dt_s = paced.dt_s;
    own.substeps = paced.count;
    variant_ = paced.variant;
    paced_frame_.begin(own);
  }
  if (has_new_images) {
    run_segment(Rate::upload);
    run_segment(Rate::capture);
    ran_whole_ = true;
  }
  if (segment(Rate::upload).groups.empty() && params.substeps > 0) ran_whole_ = true;
  if (params.substeps > 0) {
    run_segment(Rate::before);
    run_substeps(params.substeps, paced.count);
    run_segment(Rate::after);
  }
  run_segment(Rate::end);
}

void Schedule::finish(Timings& timings) {
  devices_.synchronize();
  report_times(timings);
  // Buffers grow in the first whole frame, so all later frames can replay this recording.
  if (devices_.is_cuda() && !recording().is_made && ran_whole_ && !is_profiling(devices_)) record();
  if (replays()) record_paced();
}

void Schedule::report_times(Timings& timings) {
  double at_s = begin_s_;
  const auto add = [&](const std::string& row, double seconds) {
    timings.add(row, at_s, at_s + seconds);
    at_s += seconds;
  };
  for (const Rate rate : kAllRates) {
    if (rate == Rate::substep) {
      for (const auto& [row, seconds] : times_of_substeps()) add(row, seconds);
      continue;
    }
    for (Group& group : segment(rate).groups) {
      if (std::exchange(group.ran, false)) add(group.timed_as, group.end.seconds_since(group.begin));
    }
  }
}

/// A stage of a paced step is timed in its last step. The rest of the time is that of the substeps, and of
/// what runs beside them.
std::vector<std::pair<std::string, double>> Schedule::times_of_substeps() {
  std::vector<std::pair<std::string, double>> rows;
  double left_s = std::exchange(ran_substeps_, false) ? substeps_end_.seconds_since(substeps_begin_) : 0;
  for (const Rate rate : {Rate::ahead, Rate::paced}) {
    for (Group& group : segment(rate).groups) {
      if (!std::exchange(group.ran, false)) continue;
      const double seconds = std::min(left_s, paced_ * group.end.seconds_since(group.begin));
      rows.emplace_back(group.timed_as, seconds);
      left_s -= seconds;
    }
  }
  if (left_s <= 0) return rows;
  const std::vector<Group>& groups = segment(Rate::substep).groups;
  if (groups.empty() && !rows.empty()) rows.back().second += left_s;
  const std::vector<double> shares = substep_shares();
  for (std::size_t g = 0; g < groups.size(); ++g) rows.emplace_back(groups[g].timed_as, shares[g] * left_s);
  return rows;
}

std::string Schedule::text() const {
  std::string text;
  for (const Rate rate : kAllRates) {
    if (segment(rate).groups.empty()) continue;
    text += std::string(rate_text(rate)) + "\n";
    for (const Group& group : segment(rate).groups) {
      for (const std::size_t i : group.stages) {
        const Stage& s = stages_[i];
        text += "  " + s.name + (s.every > 1 ? " (every " + std::to_string(s.every) + ")" : "") +
                (s.devices == StageDevices::all ? "  on all devices" : "  on the first device") +
                (crosses_[i] != 0 ? ", waits across devices" : "") + list_text("reads last", s.reads_last) +
                list_text("reads", s.reads) + list_text("writes", s.writes) +
                list_text("updates", s.updates) + "\n";
      }
    }
  }
  return text;
}

}  // namespace tactus
