#include "tactus/rig/live/live_keys.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <map>
#include <sstream>
#include <system_error>

#include "tactus/base/error.h"
#include "tactus/base/printable.h"
#include "tactus/base/read_file.h"
#include "tactus/rig/live/zmq_io.h"

namespace tactus {
namespace {

constexpr std::size_t kKeyBytes = 32, kKeyLetters = 40;
/// A list of 256 cameras has 20 kB.
constexpr std::uint64_t kMostBytes = 1 << 16;

bool is_key(const std::string& text) {
  std::array<std::uint8_t, kKeyBytes> bytes{};
  return text.size() == kKeyLetters && zmq_z85_decode(bytes.data(), text.c_str()) != nullptr;
}

/// A user who may write into a folder can replace a key by another file, unless the folder has the sticky
/// bit.
void check_folder_of(const std::string& path) {
  const std::string folder = path.substr(0, path.rfind('/') + 1) + ".";
  struct stat status {};
  if (::stat(folder.c_str(), &status) != 0 || (status.st_mode & 022) == 0 || (status.st_mode & S_ISVTX) != 0)
    return;
  throw Error("the folder of key file '" + printable(path) +
              "' can be changed by others; expected mode 0700: chmod go-w '" + printable(folder) + "'");
}

/// Reads a file that only its owner may read and change.
std::string read_private(const std::string& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0)
    throw Error("can't read '" + printable(path) + "': " + std::generic_category().message(errno) +
                "; 'tactus keys RIG' makes keys");
  if (status.st_uid != ::geteuid())
    throw Error("key file '" + printable(path) + "' belongs to another user; expected one of your own");
  if ((status.st_mode & 077) != 0)
    throw Error("key file '" + printable(path) +
                "' can be read or changed by others; expected mode 0600: chmod 600 '" + printable(path) +
                "'");
  check_folder_of(path);
  return read_file(path, kMostBytes, ReadFrom::regular_file);
}

/// Made with its mode, so that nobody reads it before it is narrowed.
void write_private(const std::string& path, const std::string& text, int flags) {
  const int fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW | flags, 0600);
  if (fd < 0)
    throw Error("can't write '" + path + "': " + std::generic_category().message(errno) +
                (errno == EEXIST ? "; a key is not overwritten" : ""));
  const bool ok =
      ::fchmod(fd, 0600) == 0 && ::write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  ::close(fd);
  if (!ok) throw Error("can't write '" + path + "'");
}

}  // namespace

std::string live_missing() { return ""; }

LiveKey make_live_key(const std::string& name, const std::string& server_key) {
  std::array<char, kKeyLetters + 1> open{}, secret{};
  if (zmq_curve_keypair(open.data(), secret.data()) != 0)
    throw_zmq("ZeroMQ makes no keys (was it built with CURVE?)");
  return {name, open.data(), secret.data(), server_key};
}

void write_live_key(const std::string& path, const LiveKey& key) {
  std::string text = "name " + key.name + "\npublic " + key.public_key + "\nsecret " + key.secret_key + "\n";
  if (!key.server_key.empty()) text += "server " + key.server_key + "\n";
  write_private(path, text, O_EXCL);
}

LiveKey read_live_key(const std::string& path) {
  std::istringstream lines(read_private(path));
  std::map<std::string, std::string> values;
  for (std::string word, value; lines >> word >> value;) values[word] = value;
  LiveKey key{values["name"], values["public"], values["secret"], values["server"]};
  if (key.name.empty() || !is_key(key.public_key) || !is_key(key.secret_key) ||
      (!key.server_key.empty() && !is_key(key.server_key)))
    throw Error("'" + printable(path) +
                "' is no key file; expected lines 'name', 'public', 'secret', as 'tactus keys' writes them");
  std::array<char, kKeyLetters + 1> open{};
  if (zmq_curve_public(open.data(), key.secret_key.c_str()) != 0 || key.public_key != open.data())
    throw Error("'" + printable(path) + "': its public and secret keys are no pair");
  return key;
}

void write_live_clients(const std::string& path, const std::vector<LiveClient>& clients) {
  std::string text;
  for (const LiveClient& client : clients) text += client.name + " " + client.public_key + "\n";
  write_private(path, text, O_TRUNC);
}

std::vector<LiveClient> read_live_clients(const std::string& path) {
  std::istringstream lines(read_private(path));
  std::vector<LiveClient> clients;
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    std::istringstream words(line);
    LiveClient client;
    std::string rest;
    if (!(words >> client.name)) continue;
    if (!(words >> client.public_key) || !is_key(client.public_key) || words >> rest)
      throw Error("'" + printable(path) + "' line " + std::to_string(number) +
                  ": expected a name and a key of 40 characters");
    clients.push_back(client);
  }
  return clients;
}

std::string live_key_path(const std::string& folder, const std::string& name) {
  return folder + "/" + name + ".key";
}
std::string live_clients_path(const std::string& folder) { return folder + "/clients.keys"; }

}  // namespace tactus
