#pragma once
/// `tactus doctor` beside a run that somebody looks at.
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "tactus/reconstruct/doctor/rig_doctor.h"
#include "tactus/rig/sources/frame_source.h"
#include "tactus/sim/scene.h"

namespace tactus {

/// Examines a rig once, by its first sets of images, on a thread of the lowest priority. Synthetic rigs are
/// not examined.
class RigCheckup {
 public:
  /// Sets that tell late cameras from others, as many as `tactus doctor` looks at.
  static constexpr std::size_t kSets = 11;
  enum class State : std::uint8_t { off, waiting, looking, done };
  /// The result; `error` where there is none.
  struct Result {
    Diagnosis diagnosis;
    std::string error;
  };
  /// @param done called on the checkup's thread
  RigCheckup(const SourceDescription& source, std::function<void()> done);
  /// Waits for its end.
  ~RigCheckup();
  RigCheckup(const RigCheckup&) = delete;
  RigCheckup& operator=(const RigCheckup&) = delete;

  /// Begins with the last of the sets that it waits for.
  void add(const Rig& rig, const std::vector<BitMask>& silhouettes);
  /// With the sets that there are.
  void begin();
  State state() const;
  /// nullptr: not yet.
  std::shared_ptr<const Result> result() const;

 private:
  void examine() noexcept;

  SourceDescription source_;
  std::function<void()> done_;
  DoctorInput input_;  ///< the physics' thread's until it begins
  mutable std::mutex mutex_;
  State state_ = State::off;
  std::shared_ptr<const Result> result_;
  std::thread thread_;
};

}  // namespace tactus
