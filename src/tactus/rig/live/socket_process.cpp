#include "tactus/rig/live/socket_process.h"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <system_error>

#include "tactus/base/byte_io.h"
#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/base/timing.h"

namespace tactus {
namespace {

/// Longest silence of a process that listens, and of one that still starts (a program has many libraries, a
/// machine may be busy). Only time counts in which we looked: after a pause of ours it has said enough.
constexpr double kMostSilence_s = 1, kMostStart_s = 20, kMostStep_s = 0.2;
/// Between two starts.
constexpr double kRestart_s = 0.25;
/// Receipts that wait for sockets that don't keep up.
constexpr std::size_t kMostWaitingBytes = 1 << 18;
/// Beside the message of a frame.
constexpr std::size_t kFrameBytes = 1 << 10;

void put_text(std::string& to, std::string_view text) {
  put_bytes(to, static_cast<std::uint32_t>(text.size()));
  to.append(text);
}
std::string take_text(ByteReader& from) {
  const auto bytes = from.take<std::uint32_t>();
  return std::string(from.take(bytes));
}

/// @returns the process. @param fd of its end of the link
pid_t spawn_helper(int fd) {
  // The program's own file, though another may have taken its name by now.
  constexpr const char* kSelf = "/proc/self/exe";
  std::array<char, 7> name{"tactus"};
  std::string word = socket_helper_word();
  const std::array<char*, 3> arguments{name.data(), word.data(), nullptr};
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_adddup2(&files, fd, kSocketHelperFd);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t none;
  sigemptyset(&none);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK);
  pid_t pid = -1;
  const int failed = ::posix_spawn(&pid, kSelf, &files, &attributes, arguments.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&files);
  if (failed != 0)
    throw Error(std::string("can't start a process for the sockets of live cameras: ") +
                std::generic_category().message(failed));
  return pid;
}

}  // namespace

std::string socket_settings_bytes(const SocketSettings& settings) {
  std::string bytes;
  put_text(bytes, settings.address);
  put_bytes(bytes, static_cast<std::uint8_t>(settings.is_plain ? 1 : 0));
  put_text(bytes, settings.secret_key);
  put_bytes(bytes, settings.most_bytes);
  put_bytes(bytes, settings.most_waiting);
  put_bytes(bytes, static_cast<std::uint32_t>(settings.clients.size()));
  for (const LiveClient& client : settings.clients) {
    put_text(bytes, client.name);
    put_text(bytes, client.public_key);
  }
  return bytes;
}

std::optional<SocketSettings> parse_socket_settings(std::string_view bytes) {
  ByteReader in(bytes);
  SocketSettings settings;
  settings.address = take_text(in);
  settings.is_plain = in.take<std::uint8_t>() != 0;
  settings.secret_key = take_text(in);
  settings.most_bytes = in.take<std::int64_t>();
  settings.most_waiting = in.take<std::uint32_t>();
  for (auto left = in.take<std::uint32_t>(); left > 0 && !in.failed(); --left) {
    const std::string name = take_text(in);
    settings.clients.push_back({name, take_text(in)});
  }
  if (in.failed() || in.left() > 0) return {};
  return settings;
}

SocketProcess::SocketProcess(const SocketSettings& settings) : settings_(settings) {
  const double begin_s = now_s();
  start(begin_s);
  LinkFrame none;
  while (!listens_) {
    pollfd item{fd(), POLLIN, 0};
    ::poll(&item, 1, 50);
    receive(none);
    if (!failure_.empty() || !link_->is_open() || now_s() - begin_s > kMostStart_s) break;
  }
  tended_s_ = now_s();
  if (listens_) return;
  const std::string why = failure_.empty() ? "the process of its sockets does not start" : failure_;
  end();
  throw Error(why);
}

SocketProcess::~SocketProcess() { end(); }

void SocketProcess::start(double now_s) {
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0)
    throw Error(std::string("the system gives no pair of sockets: ") +
                std::generic_category().message(errno));
  start_s_ = now_s;
  silent_s_ = 0;
  listens_ = false;
  failure_.clear();
  link_ = std::make_unique<SocketLink>(ends[0], static_cast<std::size_t>(settings_.most_bytes) + kFrameBytes);
  try {
    pid_ = spawn_helper(ends[1]);
  } catch (...) {
    ::close(ends[1]);
    link_.reset();
    throw;
  }
  ::close(ends[1]);
  link_->send({LinkFrame::setup, {}, {}, socket_settings_bytes(settings_)});
}

/// It has no state that is worth a word.
void SocketProcess::end() {
  if (pid_ > 0) {
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }
  pid_ = -1;
  link_.reset();
  listens_ = false;
}

bool SocketProcess::receive(LinkFrame& message) {
  while (link_ && link_->receive(message)) {
    silent_s_ = 0;
    switch (message.kind) {
      case LinkFrame::message:
        return true;
      case LinkFrame::listening:
        settings_.address = message.body;
        listens_ = true;
        reported_failure_.clear();
        break;
      case LinkFrame::failed:
        failure_ = message.body;
        break;
      case LinkFrame::beat:
        refused_now_ = static_cast<std::int64_t>(ByteReader(message.body).take<std::uint64_t>());
        break;
      default:
        break;
    }
  }
  return false;
}

void SocketProcess::give_credit(std::uint32_t messages) {
  std::string bytes;
  put_bytes(bytes, messages);
  if (link_ && messages > 0) link_->send({LinkFrame::credit, {}, {}, bytes});
}

void SocketProcess::send(std::string_view identity, std::string_view bytes) {
  if (link_ && link_->waiting_bytes() < kMostWaitingBytes)
    link_->send({LinkFrame::message, identity, {}, bytes});
}

void SocketProcess::tend(double now_s) {
  silent_s_ += std::clamp(now_s - tended_s_, 0.0, kMostStep_s);
  tended_s_ = now_s;
  if (link_) link_->flush();
  const bool is_silent = silent_s_ > (listens_ ? kMostSilence_s : kMostStart_s);
  if (pid_ > 0 && link_->is_open() && !is_silent) return;
  if (pid_ > 0) {
    int status = 0;
    const bool has_ended = ::waitpid(pid_, &status, WNOHANG) != 0;
    if (!has_ended && silent_s_ < kMostSilence_s) return;  // its end of the link is closed: it is ending
    std::string what = failure_;
    if (what.empty()) what = has_ended ? how_it_ended(status) : "it says nothing";
    if (has_ended) pid_ = -1;
    end();
    refused_before_ += refused_now_.exchange(0);
    ++restarts_;
    if (what != reported_failure_)
      log_warning("the process of the live sockets is started again (" + what +
                  "): cameras connect again by themselves, the run goes on");
    reported_failure_ = failure_;
  }
  if (now_s - start_s_ < kRestart_s) return;
  try {
    start(now_s);
  } catch (const Error& error) {
    start_s_ = now_s;
    if (reported_failure_ != error.what()) log_warning(error.what());
    reported_failure_ = error.what();
  }
}

std::string SocketProcess::how_it_ended(int status) const {
  if (WIFSIGNALED(status))
    return "signal " + std::to_string(WTERMSIG(status)) + ", " + ::strsignal(WTERMSIG(status));
  return "code " + std::to_string(WEXITSTATUS(status));
}

}  // namespace tactus
