#pragma once
/// What the fuzzers and the test of their findings do with an input.
#include <string>
#include <string_view>

namespace tactus::fuzz {

/// A family's input goes to every reader of the family, as the file formats tell themselves apart.
enum class Family { mesh, volume, scene, calibration, image, checkpoint, recording, packet, viewer };
Family family_of(std::string_view name);

/// Reads the bytes as a file of the family. An Error is an answer; whatever else comes out is a finding.
void read_input(Family family, const std::string& bytes);

/// Two blocks, as a body's.
void read_checkpoint(const std::string& bytes);

}  // namespace tactus::fuzz
