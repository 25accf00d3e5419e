#pragma once
/// A thread beside the caller's that does jobs in order.
#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>

namespace tactus {

/// Give it jobs; `finish` waits for them and rethrows the exception of a job that failed. After a failure,
/// jobs are dropped.
class Worker {
 public:
  /// @param most_waiting jobs that wait; a caller that is that far ahead waits, too
  explicit Worker(std::size_t most_waiting) : most_waiting_(most_waiting), thread_([this] { work(); }) {}
  ~Worker() { stop(); }
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  /// @throws the exception of an earlier job.
  void add(std::function<void()> job);
  /// Waits until all jobs are done. @throws the exception of a job that failed.
  void finish();

 private:
  void work();
  void stop() noexcept;
  void rethrow();

  std::size_t most_waiting_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> jobs_;
  bool busy_ = false, stops_ = false, failed_ = false;
  std::exception_ptr error_;
  std::thread thread_;  ///< last: it uses the others
};

}  // namespace tactus
