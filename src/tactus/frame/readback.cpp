#include "tactus/frame/readback.h"

#include "tactus/base/error.h"

namespace tactus {

Readback::Place Readback::add_words(const std::uint32_t* from, Index words, Index count, int part) {
  Part& p = parts_[static_cast<std::size_t>(part)];
  if (!p.gathered.empty()) throw Error("readback: records are added before the first frame");
  const Place place{static_cast<std::size_t>(part), p.words, count};
  p.items.push_back({from, words, p.words});
  p.words += words;
  return place;
}

void Readback::allocate(ExecContext& ctx, Part& part) {
  std::vector<Index> item_of_word;
  for (std::size_t i = 0; i < part.items.size(); ++i)
    item_of_word.insert(item_of_word.end(), static_cast<std::size_t>(part.items[i].words),
                        static_cast<Index>(i));
  part.items_on_device = to_device(ctx, part.items);
  part.item_of_word = to_device(ctx, item_of_word);
  part.gathered = Buffer<std::uint32_t>(ctx.device(), part.words);
  part.read = HostBuffer<std::uint32_t>(ctx.device(), part.words);
}

void Readback::submit() {
  devices_.for_each_part([&](ExecContext& ctx, int p) {
    Part& part = parts_[static_cast<std::size_t>(p)];
    if (part.words == 0) return;
    if (part.gathered.empty()) allocate(ctx, part);
    ctx.parallel_for("frame/gather_records", part.words,
                     GatherRecords{part.items_on_device.const_view(), part.item_of_word.const_view(),
                                   part.gathered.view()});
    ctx.download(part.gathered.const_view(), part.read.span());
  });
}

const std::uint32_t* Readback::words(const Place& place) const {
  return parts_[place.part].read.data() + place.first_word;
}

}  // namespace tactus
