#include "fuzz/readers.h"
#include "tactus/frame/state_archive.h"

namespace tactus::fuzz {

void read_checkpoint(const std::string& bytes) {
  // No fuzzer finds the hash of what it made: what is no file is taken for its blocks.
  const bool is_file = bytes.starts_with("TACTUSCP");
  StateArchive a(is_file ? bytes : StateArchive::with_header(bytes), "a.checkpoint");
  a.set_owner("body 'a'");
  double time_s = 0;
  std::vector<float> x(4);
  a.value("time", time_s);
  a.values("positions", x);
  a.finish();
}

}  // namespace tactus::fuzz
