#pragma once
/// The order of a frame, derived from the resources that its stages read and write.
#include <array>
#include <memory>

#include "tactus/base/timing.h"
#include "tactus/compute/side_stream.h"
#include "tactus/compute/time_stamp.h"
#include "tactus/frame/frame_on_devices.h"
#include "tactus/frame/stage.h"
#include "tactus/multi_device/device_replay.h"

namespace tactus {

/// Steps of a frame that are independent of its substeps.
struct PacedSteps {
  int count = 0;
  float dt_s = 0;  ///< of each
  /// Which of several sets of submissions stages of rates ahead and paced make; each has a recording of its
  /// own, made after its first frame.
  std::size_t variant = 0;
};

/// Holds the stages of a frame, knows in which order they run and which device waits for which, and replays
/// them as recorded graphs on GPUs.
///
///   schedule.add(stage); ...        // solvers' stages, in any order
///   schedule.close();               // @throws Error for stages that can't be ordered
///   per frame: schedule.run(params, has_new_images); schedule.finish(timings);
///
/// A frame is: stages of rates upload and capture (when there are new images); before, n times substep, after
/// (when n > 0); end. Paced step k of p comes once (k + 1) n / p substeps are done; stages of rate ahead come
/// once after the paced step before, and run beside the substeps in between. On a GPU, the frame is
/// recorded once the first one with images is done, or with substeps where nothing uploads any: one graph for
/// each rate, and for substeps one for each power of two up to 16 units. A unit is as many substeps as all
/// stages' `every` and `period` divide. Any number of substeps is a few launches of these, so nothing is
/// recorded anew when it changes. Stages that submit something else from a frame on say so by select(): each
/// choice has a recording of its own, made in its first frame.
class Schedule {
 public:
  explicit Schedule(DeviceSet& devices);

  /// @throws Error when the name is taken, or the schedule closed.
  void add(Stage stage);
  /// Puts the stages in order. @throws Error naming the stages of a cycle, or one that reads a resource that
  /// no stage writes.
  void close();

  /// Submits a frame; `params.substeps` is a multiple of unit(). Asynchronous.
  void run(const FrameParams& params, bool has_new_images, PacedSteps paced = {});
  /// Waits for the frame on the host and adds the times of its stages. Records, once there was a whole frame.
  void finish(Timings& timings);

  /// Numbers of substeps are multiples of this.
  int unit() const { return unit_; }
  /// How often the frame was put together for replay: 1, unless select(), record_anew() or clear() was
  /// called.
  int recordings() const { return made_; }
  /// Whether the next frame replays a recording.
  bool replays() const;
  /// After a buffer moved or grew.
  void record_anew();
  /// All stages are added anew, then close() again: what they submit has changed between two frames. Nothing
  /// may be on the way.
  void clear();
  /// Which of several sets of submissions the stages make from now on; before a run with new images.
  /// @param choice 0: the first
  void select(std::size_t choice);
  const FrameOnDevices& frame() const { return frame_; }
  /// The same for paced stages: `dt_s` is that of their steps, and `substeps` their number.
  const FrameOnDevices& paced_frame() const { return paced_frame_; }
  /// The frame as a table: stages in order, rates, devices, resources that each stage reads and writes, and
  /// waits across devices.
  std::string text() const;

 private:
  static constexpr std::size_t kBlocks = 5;  ///< of 1, 2, 4, 8 and 16 units
  /// Consecutive stages of one rate whose time counts in the same row.
  struct Group {
    std::string timed_as;
    std::vector<std::size_t> stages;
    TimeStamp begin, end;
    std::vector<TimeStamp> begins, ends;  ///< rate substep: in the first unit of the last block
    bool ran = false;
  };
  struct Segment {
    std::vector<Group> groups;
  };
  /// Stages of rates ahead and paced, for replay.
  struct PacedStep {
    DeviceGraph ahead, step;
  };
  /// A frame for replay.
  struct Recording {
    std::array<DeviceGraph, kRates> segments;
    std::array<DeviceGraph, kBlocks> blocks;
    std::vector<std::unique_ptr<PacedStep>> paced;  ///< by variant
    bool is_made = false;
  };
  using After = std::vector<std::vector<std::size_t>>;  ///< per stage, those that come before it

  After find_edges() const;
  void add_edges_of(const Resource& resource, After& after) const;
  void order(Rate rate, const After& after);
  void submit_stage(std::size_t stage, BlockPlace place);
  void submit_groups(Segment& segment);
  void submit_block(int units);
  void submit_substep(BlockPlace place);
  void run_segment(Rate rate);
  void run_substeps(int substeps, int paced);
  void run_units(int units);
  /// nullptr where the steps of this frame aren't recorded.
  PacedStep* recorded_step();
  void begin_paced();
  void run_paced();
  void record_paced();
  void record();
  void report_times(Timings& timings);
  std::vector<std::pair<std::string, double>> times_of_substeps();
  std::vector<double> substep_shares() const;
  Recording& recording() { return *recordings_[choice_]; }
  const Recording& recording() const { return *recordings_[choice_]; }
  DeviceGraph& graph(Rate rate) { return recording().segments[static_cast<std::size_t>(rate)]; }
  Segment& segment(Rate rate) { return segments_[static_cast<std::size_t>(rate)]; }
  const Segment& segment(Rate rate) const { return segments_[static_cast<std::size_t>(rate)]; }
  void wait_for_first();
  void wait_for_all();

  DeviceSet& devices_;
  FrameOnDevices frame_, paced_frame_;
  std::vector<Stage> stages_;
  std::vector<char> crosses_;  ///< per stage: it depends on one that ran on other devices
  std::array<Segment, kRates> segments_;
  std::vector<std::unique_ptr<Recording>> recordings_;  ///< by choice
  std::size_t choice_ = 0, variant_ = 0;
  TimeStamp substeps_begin_, substeps_end_;
  std::vector<Event> forked_;                ///< per device
  std::unique_ptr<SideStream> side_stream_;  ///< on GPUs
  bool closed_ = false, ran_whole_ = false, ran_substeps_ = false, runs_beside_ = false;
  int unit_ = 1, made_ = 1, paced_ = 0;
  double begin_s_ = 0;
};

}  // namespace tactus
