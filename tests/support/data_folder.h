#pragma once
/// Where tests find recordings and the files of the source tree.
#include <string>

namespace tactus {

/// The folder of recordings with known answers: $TACTUS_DATA, else shared/data beside the checkout (and then
/// TACTUS_DATA is set to it); "" without either.
std::string data_folder();
/// Why a test that needs it is skipped: one wording for all. @param what folder or file of the data
std::string without_data(const std::string& what);
/// A file of the source tree: "rigs/horseman.yaml".
std::string source_path(const std::string& name);

}  // namespace tactus
