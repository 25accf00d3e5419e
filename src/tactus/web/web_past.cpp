#include "tactus/web/web_past.h"

#include <utility>

#include "tactus/base/error.h"

namespace tactus {

int WebPast::run() const {
  const std::lock_guard lock(mutex_);
  return run_;
}

void WebPast::add(const Bytes& message, int number, int run, std::shared_ptr<const PastState> state) {
  const std::lock_guard lock(mutex_);
  if (run != run_) return;
  const std::size_t bytes = message->size() + (state ? state->bytes.size() : 0);
  past_.add({message, std::move(state), number, bytes});
  if (seen_ == 0) options_.show(message);
}

/// Called with the lock.
void WebPast::see(const Entry* entry) {
  if (entry == nullptr)
    throw Error(past_.is_kept() ? "no frame was seen yet" : "no frames are kept: start with --web-past 256");
  seen_ = entry == past_.last() ? 0 : entry->number;
  options_.show(entry->frame);
}

void WebPast::see(int number) {
  {
    const std::lock_guard lock(mutex_);
    see(past_.nearest(number));
  }
  options_.changed();
}

void WebPast::move(int steps) {
  {
    const std::lock_guard lock(mutex_);
    const Entry* newest = past_.last();
    see(past_.moved(seen_ > 0 || newest == nullptr ? seen_ : newest->number, steps));
  }
  options_.changed();
}

void WebPast::leave() {
  {
    const std::lock_guard lock(mutex_);
    if (seen_ == 0) return;
    see(past_.last());
  }
  options_.changed();
}

void WebPast::ask_again() {
  const std::lock_guard lock(mutex_);
  if (seen_ == 0) throw Error("no frame of the past is shown: go back to one first, by 'see'");
  again_ = past_.state_at(seen_);
  if (again_ == nullptr) throw Error("no state was kept up to that frame");
}

std::shared_ptr<const PastState> WebPast::go_back() {
  const std::lock_guard lock(mutex_);
  ++run_;
  past_.forget_after(again_->number);
  see(past_.last());
  return std::exchange(again_, nullptr);
}

WebPast::Shown WebPast::shown() const {
  const std::lock_guard lock(mutex_);
  if (past_.last() == nullptr) return {};
  Shown shown{past_.first()->number, past_.last()->number, seen_, 0};
  if (const auto state = seen_ > 0 ? past_.state_at(seen_) : nullptr) shown.again_from = state->number;
  return shown;
}

}  // namespace tactus
