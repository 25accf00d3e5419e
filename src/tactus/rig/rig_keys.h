#pragma once
/// Every key of a rig file, declared once, for the reader and for docs/rig.md.
#include <ostream>
#include <span>
#include <string>
#include <vector>

namespace tactus {

struct RigKey {
  const char *name, *type, *otherwise, *meaning;  ///< `otherwise`: the default, or "**required**"
};
struct RigSection {
  const char* where;  ///< "" for the file itself, "cameras[]"
  std::vector<RigKey> keys;
};
std::span<const RigSection> rig_sections();
/// Names of the keys of a section. @throws std::out_of_range for a section that is not there.
std::vector<std::string> rig_keys(const std::string& where);

/// docs/rig.md.
void write_rig_reference(std::ostream& out);

}  // namespace tactus
