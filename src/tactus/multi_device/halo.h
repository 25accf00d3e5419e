#pragma once
/// Copies that parts of a partition hold of their neighbours' elements, and how they are kept up to date.
#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include "tactus/multi_device/device_set.h"
#include "tactus/multi_device/halo_kernels.h"

namespace tactus {

/// `holder` has copies of elements of `owner`.
struct HaloLink {
  int holder = 0, owner = 0;
  Index count = 0;
  Index first_there = 0, first_here = 0;     ///< where they begin, of the owner and of the holder
  std::vector<Index> there = {}, here = {};  ///< or lists instead; both or none
};

enum class HaloOp : std::uint8_t {
  update,      ///< copies get the values of their owners' elements
  accumulate,  ///< sums in the copies are added to the owners' elements, link after link
};

/// Keeps kFields fields that change together consistent over the parts of a set. A step:
///
/// 1. Each part runs the work that reads copies, calls await_readers, writes its own elements, calls begin.
/// 2. Work that needs no copies.
/// 3. finish.
///
/// To accumulate, copies are written between await_readers and begin, instead of own elements; the bits of a
/// sum of floats then depend on the partition. `fields(part)` gives the views of a part, all its elements.
///
/// All is asynchronous, nothing is allocated. A recording (DeviceReplay) starts with begin and finish, as it
/// can't wait for events before it. Kernels read the other part's memory; where they can't, it is copied
/// first.
///
/// On virtual devices stale copies become NaN. To update, that is at `begin`, and in await_readers where no
/// `begin` came since the last await_readers; to accumulate, in await_readers. So code that reads copies too
/// early, or forgets to update them, gives NaN instead of old values.
template <class T, int kFields = 1>
class Halo {
 public:
  using Fields = std::array<View<T>, kFields>;

  /// @param name in errors and profiles; must outlive the halo. @throws Error naming a bad link.
  Halo(DeviceSet& devices, const char* name, const std::vector<HaloLink>& links, HaloOp op = HaloOp::update);

  /// From here on `part` overwrites elements that others read: waits until they have read them.
  template <class F>
  void await_readers(int part, F&& fields);
  /// The elements of `part` that others read are final.
  template <class F>
  void begin(int part, F&& fields);
  /// Updates or accumulates, for all parts. @throws Error when a part that others read hasn't begun.
  template <class F>
  void finish(F&& fields);

 private:
  /// One part reads another: in updates the holder its owner, else the owner a holder.
  struct Link {
    int reader, source;
    Index count;
    HaloElements there, here;
    Buffer<Index> there_list, here_list;
    Slab range;                           ///< of elements there
    std::array<Buffer<T>, kFields> copy;  ///< of `range`, where kernels can't read it
  };
  struct State {
    Event written, read;
    std::vector<int> sources, readers;
    bool has_begun = false, is_writing = false;
  };
  using Source = typename PullHalo<T, kFields>::Source;

  static std::size_t at(int i) { return static_cast<std::size_t>(i); }
  void check(const HaloLink& link) const;
  void add_link(const HaloLink& link);
  bool copies_first(const Link& link) const {
    return !devices_.reads_peers() && (op_ == HaloOp::accumulate || !link.there.list.empty());
  }
  void poison(int part, const Fields& fields);
  Source source_of(ExecContext& ctx, Link& link, const Fields& from);
  template <class F>
  void pull(int part, F& fields);
  template <class F>
  void add(int part, F& fields);

  DeviceSet& devices_;
  const char* name_;
  HaloOp op_;
  std::vector<Link> links_;
  std::vector<State> states_;
};

template <class T, int kFields>
Halo<T, kFields>::Halo(DeviceSet& devices, const char* name, const std::vector<HaloLink>& links, HaloOp op)
    : devices_(devices), name_(name), op_(op), states_(at(devices.count())) {
  for (const HaloLink& link : links) {
    check(link);
    if (link.count > 0) add_link(link);
  }
}

template <class T, int kFields>
void Halo<T, kFields>::check(const HaloLink& link) const {
  const std::string what = std::string("halo '") + name_ + "': part " + std::to_string(link.holder) +
                           " copies " + std::to_string(link.count) + " elements of part " +
                           std::to_string(link.owner);
  const auto is_part = [&](int part) { return part >= 0 && part < devices_.count(); };
  if (!is_part(link.holder) || !is_part(link.owner) || link.holder == link.owner)
    throw Error(what + ", expected two of " + std::to_string(devices_.count()) + " parts");
  const auto fits = [&](const std::vector<Index>& list) {
    return list.empty() || list.size() == at(link.count);
  };
  if (link.count < 0 || !fits(link.there) || !fits(link.here) || link.there.empty() != link.here.empty())
    throw Error(what + ", but lists have " + std::to_string(link.there.size()) + " and " +
                std::to_string(link.here.size()));
}

template <class T, int kFields>
void Halo<T, kFields>::add_link(const HaloLink& link) {
  const bool updates = op_ == HaloOp::update;
  Link made{.reader = updates ? link.holder : link.owner,
            .source = updates ? link.owner : link.holder,
            .count = link.count,
            .there = {{}, updates ? link.first_there : link.first_here},
            .here = {{}, updates ? link.first_here : link.first_there},
            .there_list = {},
            .here_list = {},
            .range = {},
            .copy = {}};
  ExecContext& ctx = devices_.context(made.reader);
  made.range = {made.there.first, made.there.first + link.count};
  if (!link.there.empty()) {
    const std::vector<Index>& there = updates ? link.there : link.here;
    made.there_list = to_device(ctx, there);
    made.here_list = to_device(ctx, updates ? link.here : link.there);
    made.there = {made.there_list.const_view(), 0};
    made.here = {made.here_list.const_view(), 0};
    const auto [least, most] = std::minmax_element(there.begin(), there.end());
    made.range = {*least, *most + 1};
  }
  if (copies_first(made))
    for (Buffer<T>& copy : made.copy) copy = Buffer<T>(ctx.device(), made.range.count());
  states_[at(made.reader)].sources.push_back(made.source);
  states_[at(made.source)].readers.push_back(made.reader);
  links_.push_back(std::move(made));
}

template <class T, int kFields>
template <class F>
void Halo<T, kFields>::await_readers(int part, F&& fields) {
  State& state = states_[at(part)];
  for (const int reader : state.readers) devices_.context(part).wait(states_[at(reader)].read);
  if (op_ == HaloOp::accumulate || state.is_writing) poison(part, fields(part));
  state.is_writing = true;
}

template <class T, int kFields>
template <class F>
void Halo<T, kFields>::begin(int part, F&& fields) {
  State& state = states_[at(part)];
  devices_.context(part).record(state.written);
  if (op_ == HaloOp::update) poison(part, fields(part));
  state.has_begun = true;
  state.is_writing = false;
}

template <class T, int kFields>
template <class F>
void Halo<T, kFields>::finish(F&& fields) {
  for (const Link& link : links_) {
    if (!states_[at(link.source)].has_begun)
      throw Error(std::string("halo '") + name_ + "': finish, but part " + std::to_string(link.source) +
                  " has not begun");
  }
  for (State& state : states_) state.has_begun = false;
  for (int part = 0; part < devices_.count(); ++part) {
    ExecContext& ctx = devices_.context(part);
    State& state = states_[at(part)];
    for (const int source : state.sources) ctx.wait(states_[at(source)].written);
    if (state.sources.empty()) continue;
    if (op_ == HaloOp::update)
      pull(part, fields);
    else
      add(part, fields);
    ctx.record(state.read);
  }
}

/// All bits set, in the copies of a virtual device.
template <class T, int kFields>
void Halo<T, kFields>::poison(int part, const Fields& fields) {
  if (devices_.device(part).kind() != DeviceKind::virtual_cpu) return;
  for (const Link& link : links_) {
    if (part != (op_ == HaloOp::update ? link.reader : link.source)) continue;
    PoisonHalo<T, kFields> kernel{op_ == HaloOp::update ? link.here : link.there, {}};
    std::copy(fields.begin(), fields.end(), kernel.to);
    devices_.context(part).parallel_for(name_, link.count, kernel);
  }
}

template <class T, int kFields>
typename Halo<T, kFields>::Source Halo<T, kFields>::source_of(ExecContext& ctx, Link& link,
                                                              const Fields& from) {
  Source source{{}, link.there, link.here, link.count};
  std::copy(from.begin(), from.end(), source.from);
  if (!copies_first(link)) return source;
  for (std::size_t f = 0; f < kFields; ++f) {
    ctx.copy(View<const T>(from[f].part(link.range.begin, link.range.count())), link.copy[f].view());
    source.from[f] = link.copy[f].const_view();
  }
  source.there.first = link.there.list.empty() ? 0 : link.range.begin;
  return source;
}

template <class T, int kFields>
template <class F>
void Halo<T, kFields>::pull(int part, F& fields) {
  ExecContext& ctx = devices_.context(part);
  const Fields to = fields(part);
  PullHalo<T, kFields> kernel;
  std::copy(to.begin(), to.end(), kernel.to);
  int sources = 0;
  const auto launch = [&] {
    ctx.parallel_for(name_, kernel.source[0].count + kernel.source[1].count, kernel);
    kernel.source[0].count = kernel.source[1].count = 0;
    sources = 0;
  };
  for (Link& link : links_) {
    if (link.reader != part) continue;
    const Fields from = fields(link.source);
    if (!devices_.reads_peers() && link.there.list.empty()) {  // right to where they belong
      for (std::size_t f = 0; f < kFields; ++f)
        ctx.copy(View<const T>(from[f].part(link.there.first, link.count)),
                 to[f].part(link.here.first, link.count));
      continue;
    }
    kernel.source[sources++] = source_of(ctx, link, from);
    if (sources == 2) launch();
  }
  launch();
}

template <class T, int kFields>
template <class F>
void Halo<T, kFields>::add(int part, F& fields) {
  ExecContext& ctx = devices_.context(part);
  const Fields to = fields(part);
  for (Link& link : links_) {
    if (link.reader != part) continue;
    AddHalo<T, kFields> kernel{source_of(ctx, link, fields(link.source)), {}};
    std::copy(to.begin(), to.end(), kernel.to);
    ctx.parallel_for(name_, link.count, kernel);
  }
}

}  // namespace tactus
