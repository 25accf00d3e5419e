#include "tactus/rig/marker_dictionaries.h"

#include <algorithm>

#include "tactus/base/error.h"

namespace tactus {

const std::vector<std::string>& marker_dictionaries() {
  static const std::vector<std::string> all{"4X4_50",   "4X4_100",       "4X4_250",  "4X4_1000", "5X5_50",
                                            "5X5_100",  "5X5_250",       "5X5_1000", "6X6_50",   "6X6_100",
                                            "6X6_250",  "6X6_1000",      "7X7_50",   "7X7_100",  "7X7_250",
                                            "7X7_1000", "ARUCO_ORIGINAL"};
  return all;
}

int marker_dictionary(const std::string& name) {
  const std::vector<std::string>& all = marker_dictionaries();
  const auto at = std::find(all.begin(), all.end(), name);
  if (at == all.end())
    throw usage_error("no dictionary of markers is called '" + name + "'" + suggestion(name, all));
  return static_cast<int>(at - all.begin());
}

int marker_count(const std::string& dictionary) {
  marker_dictionary(dictionary);
  return dictionary == "ARUCO_ORIGINAL" ? 1024 : std::stoi(dictionary.substr(dictionary.find('_') + 1));
}

}  // namespace tactus
