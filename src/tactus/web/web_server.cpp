#include "tactus/web/web_server.h"

#include <arpa/inet.h>
#include <civetweb.h>
#include <dlfcn.h>
#include <netinet/in.h>
#include <pthread.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "tactus/base/error.h"
#include "tactus/web/client_message.h"
#include "tactus/web/viewer_checks.h"
#include "tactus/web/web_files.h"

/// civetweb gives its threads 100 KB, of which thread-local storage takes most: its own log of a viewer that
/// drops in the middle of a message then overflows the stack. The program's definition comes before libc's.
extern "C" int pthread_attr_setstacksize(pthread_attr_t* attributes, std::size_t bytes) {
  using SetSize = int (*)(pthread_attr_t*, std::size_t);
  constexpr std::size_t kLeast = std::size_t{1} << 20;
  static const auto set_size = reinterpret_cast<SetSize>(dlsym(RTLD_NEXT, "pthread_attr_setstacksize"));
  return set_size(attributes, std::max(bytes, kLeast));
}

namespace tactus {
namespace {

using Bytes = std::shared_ptr<const std::string>;

/// One viewer: a thread that sends, and the newest frame. Browsers take messages from the
/// network while they draw, without bounds: only a viewer that says which frames it got has the newest.
class Viewer {
 public:
  /// @param most_ahead frames that it hasn't got yet; 0: it doesn't say so
  Viewer(mg_connection* connection, Bytes setting, int most_ahead)
      : connection_(connection), most_ahead_(most_ahead) {
    messages_.push_back({std::move(setting), MG_WEBSOCKET_OPCODE_BINARY});
    thread_ = std::thread([this] { send(); });
  }
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;
  ~Viewer() {
    {
      const std::lock_guard lock(mutex_);
      closes_ = true;
    }
    changed_.notify_one();
    thread_.join();
  }

  void give_frame(Bytes frame) {
    {
      const std::lock_guard lock(mutex_);
      frame_ = std::move(frame);
    }
    changed_.notify_one();
  }
  void note_got(int frames) {
    {
      const std::lock_guard lock(mutex_);
      ahead_ = std::max(ahead_ - frames, 0);
    }
    changed_.notify_one();
  }
  void give_text(Bytes text) {
    {
      const std::lock_guard lock(mutex_);
      if (messages_.size() < kMostTexts) messages_.push_back({std::move(text), MG_WEBSOCKET_OPCODE_TEXT});
    }
    changed_.notify_one();
  }

 private:
  struct Message {
    Bytes bytes;
    int opcode;
  };
  static constexpr std::size_t kMostTexts = 32;

  bool may_send_frame() const { return frame_ != nullptr && (most_ahead_ == 0 || ahead_ < most_ahead_); }
  void send() {
    while (true) {
      Message next{nullptr, MG_WEBSOCKET_OPCODE_BINARY};
      {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] { return closes_ || may_send_frame() || !messages_.empty(); });
        if (closes_) return;
        if (messages_.empty()) {
          next.bytes = std::move(frame_);
          frame_ = nullptr;
          ++ahead_;
        } else {
          next = std::move(messages_.front());
          messages_.pop_front();
        }
      }
      // A message that was cut off leaves nothing to say on the connection.
      if (mg_websocket_write(connection_, next.opcode, next.bytes->data(), next.bytes->size()) <= 0) return;
    }
  }

  mg_connection* connection_;
  const int most_ahead_;
  int ahead_ = 0;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Message> messages_;
  Bytes frame_;
  bool closes_ = false;
  std::thread thread_;  ///< last: it uses the others
};

/// Pages may load nothing from elsewhere, nor be framed, nor send forms.
std::string security_headers(const char* host) {
  std::string at = host == nullptr ? "" : host;
  constexpr const char* kPlain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789.:-";
  if (at.find_first_not_of(kPlain) != at.npos) at.clear();  // it could end the rule
  return "Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' "
         "data:; "
         "connect-src 'self' ws://" +
         at + " wss://" + at +
         "; base-uri 'none'; form-action 'none'; frame-ancestors 'none'\r\n"
         "X-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\n"
         "Cross-Origin-Opener-Policy: same-origin\r\nCross-Origin-Resource-Policy: same-origin\r\n"
         "Cache-Control: no-store\r\n";
}

void answer(mg_connection* connection, const char* status, std::string_view type, std::string_view text,
            bool with_text = true) {
  const std::string head = std::string("HTTP/1.1 ") + status + "\r\nContent-Type: " + std::string(type) +
                           "\r\nContent-Length: " + std::to_string(text.size()) + "\r\n" +
                           security_headers(mg_get_header(connection, "Host")) + "Connection: close\r\n\r\n";
  mg_write(connection, head.data(), head.size());
  if (with_text) mg_write(connection, text.data(), text.size());
}

/// Connects to a port of this computer, and leaves.
void wake(int port) {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(port));
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0) return;
  static_cast<void>(::connect(fd, reinterpret_cast<const sockaddr*>(&to), sizeof to));
  ::close(fd);
}

std::string query_value(const mg_request_info& request, const char* key) {
  std::array<char, 128> value{};
  if (request.query_string == nullptr) return "";
  const int size =
      mg_get_var(request.query_string, std::strlen(request.query_string), key, value.data(), value.size());
  return size > 0 ? std::string(value.data(), static_cast<std::size_t>(size)) : "";
}

/// Frames that are sent ahead of those that the viewer got; 0: it doesn't say; none: what it says is wrong.
std::optional<int> frames_ahead(const mg_request_info& request) {
  const std::string text = query_value(request, "ahead");
  if (text.empty()) return 0;
  if (text.size() > 1 || text[0] < '1' || text[0] > '9') return std::nullopt;
  return text[0] - '0';
}

/// Whether sockets can be bound to that IPv4 address, here.
bool is_own_address(const std::string& address) {
  sockaddr_in at{};
  at.sin_family = AF_INET;
  if (inet_pton(AF_INET, address.c_str(), &at.sin_addr) != 1) return false;
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return true;  // unknown
  const bool is_bound = ::bind(fd, reinterpret_cast<const sockaddr*>(&at), sizeof at) == 0;
  ::close(fd);
  return is_bound;
}

}  // namespace

std::string web_missing() { return ""; }

struct WebServer::Impl {
  Impl(const WebSettings& settings_in, std::string setting_in, OnMessage on_message_in)
      : settings(settings_in),
        setting(std::make_shared<const std::string>(std::move(setting_in))),
        on_message(std::move(on_message_in)) {}

  void start();
  /// "", or the reason for a 403.
  std::string refusal(const mg_connection* connection) const;
  int page(mg_connection* connection) const;
  int connect(mg_connection* connection);
  void add(mg_connection* connection);
  void remove(const mg_connection* connection);
  int take(mg_connection* connection, int bits, std::string_view text);

  WebSettings settings;
  Bytes setting;
  OnMessage on_message;
  mutable std::mutex mutex;
  std::vector<std::pair<const mg_connection*, std::shared_ptr<Viewer>>> viewers;
  Bytes newest_frame, newest_state;
  int listening_port = 0;
  mg_context* context = nullptr;
};

std::string WebServer::Impl::refusal(const mg_connection* connection) const {
  const auto text = [&](const char* name) {
    const char* value = mg_get_header(connection, name);
    return std::string(value == nullptr ? "" : value);
  };
  return host_refusal(settings.is_loopback(), text("Host"), settings.name);
}

int WebServer::Impl::page(mg_connection* connection) const {
  const mg_request_info* request = mg_get_request_info(connection);
  const std::string method = request->request_method == nullptr ? "" : request->request_method;
  if (method != "GET" && method != "HEAD") {
    answer(connection, "405 Method Not Allowed", "text/plain", "only GET and HEAD\n");
    return 405;
  }
  if (const std::string why = refusal(connection); !why.empty()) {
    answer(connection, "403 Forbidden", "text/plain", why + "\n", method == "GET");
    return 403;
  }
  std::string_view name = request->local_uri == nullptr ? "" : request->local_uri;
  if (name.starts_with('/')) name.remove_prefix(1);
  if (name.empty()) name = "index.html";
  if (const std::string missing = web_page_missing(); !missing.empty() && name == "index.html") {
    answer(connection, "503 Service Unavailable", "text/plain", "without " + missing + "\n", method == "GET");
    return 503;
  }
  const WebFile* file = find_web_file(name);
  if (file == nullptr) {
    answer(connection, "404 Not Found", "text/plain", "there is no such file\n", method == "GET");
    return 404;
  }
  answer(connection, "200 OK", file->type, file->text, method == "GET");
  return 200;
}

int WebServer::Impl::connect(mg_connection* connection) {
  const mg_request_info* request = mg_get_request_info(connection);
  if (request->local_uri == nullptr || std::string_view(request->local_uri) != "/stream") {
    answer(connection, "404 Not Found", "text/plain", "the stream is at /stream\n");
    return 1;
  }
  const char* origin = mg_get_header(connection, "Origin");
  const char* host = mg_get_header(connection, "Host");
  std::string why = refusal(connection);
  if (why.empty() && origin != nullptr && !is_same_origin(origin, host == nullptr ? "" : host))
    why = "pages of another origin may not look";
  if (why.empty() && !settings.token.empty() &&
      !is_same_token(query_value(*request, "token"), settings.token))
    why = "a wrong token: open the address that the run printed";
  if (!why.empty()) {
    answer(connection, "403 Forbidden", "text/plain", why + "\n");
    return 1;
  }
  if (!frames_ahead(*request)) {
    answer(connection, "400 Bad Request", "text/plain",
           "'ahead' is '" + query_value(*request, "ahead") + "', expected a whole number from 1 to 9\n");
    return 1;
  }
  const std::lock_guard lock(mutex);
  if (viewers.size() < kMostViewers) return 0;
  answer(connection, "503 Service Unavailable", "text/plain", "too many viewers\n");
  return 1;
}

void WebServer::Impl::add(mg_connection* connection) {
  const std::lock_guard lock(mutex);
  const auto viewer = std::make_shared<Viewer>(connection, setting,
                                               frames_ahead(*mg_get_request_info(connection)).value_or(0));
  if (newest_state) viewer->give_text(newest_state);
  if (newest_frame) viewer->give_frame(newest_frame);
  viewers.emplace_back(connection, viewer);
}

void WebServer::Impl::remove(const mg_connection* connection) {
  std::shared_ptr<Viewer> gone;  // its thread is waited for without the lock
  const std::lock_guard lock(mutex);
  const auto found =
      std::find_if(viewers.begin(), viewers.end(), [&](const auto& v) { return v.first == connection; });
  if (found == viewers.end()) return;
  gone = std::move(found->second);
  viewers.erase(found);
}

/// @returns 0 to close the connection.
int WebServer::Impl::take(mg_connection* connection, int bits, std::string_view text) {
  const int opcode = bits & 0x0F;
  if (opcode == MG_WEBSOCKET_OPCODE_CONNECTION_CLOSE) return 0;
  if (opcode == MG_WEBSOCKET_OPCODE_PING || opcode == MG_WEBSOCKET_OPCODE_PONG) return 1;
  const bool is_whole = (bits & 0x80) != 0;
  if (opcode != MG_WEBSOCKET_OPCODE_TEXT || !is_whole || text.size() > kMostClientBytes) return 0;
  const int got = frames_got(text);
  const std::string reply = got == 0 && on_message ? on_message(text) : "";
  if (reply.empty() && got == 0) return 1;
  const std::lock_guard lock(mutex);
  for (const auto& [of, viewer] : viewers)
    if (of == connection)
      got > 0 ? viewer->note_got(got) : viewer->give_text(std::make_shared<const std::string>(reply));
  return 1;
}

void WebServer::Impl::start() {
  const std::string ports = settings.address + ":" + std::to_string(settings.port);
  const std::string threads = std::to_string(kMostViewers + 8);
  std::vector<const char*> options{"listening_ports",
                                   ports.c_str(),
                                   "num_threads",
                                   threads.c_str(),
                                   "request_timeout_ms",
                                   "10000",
                                   "websocket_timeout_ms",
                                   "10000",
                                   "enable_websocket_ping_pong",
                                   "yes",
                                   "tcp_nodelay",
                                   "1"};
  options.push_back(nullptr);
  mg_callbacks callbacks{};
  callbacks.log_message = [](const mg_connection*, const char*) { return 1; };
  std::array<char, 256> why{};
  unsigned code = 0;
  mg_init_data init{&callbacks, this, options.data()};
  mg_error_data error{&code, why.data(), why.size()};
  context = mg_start2(&init, &error);
  if (context == nullptr)
    throw Error(
        "--web " + settings.address + ":" + std::to_string(settings.port) + ": can't listen there" +
        (why[0] == '\0' ? "" : " (" + std::string(why.data()) + ")") +
        (is_own_address(settings.address)
             ? "; another program may: try another port, as --web " + settings.address + ":" +
                   std::to_string(settings.port + 1)
             : "; this computer has no such address: 127.0.0.1 is for viewers on it, 0.0.0.0 for all"));
  mg_server_port listening{};
  if (mg_get_server_ports(context, 1, &listening) > 0) listening_port = listening.port;
  mg_set_request_handler(
      context, "**", [](mg_connection* c, void* self) { return static_cast<Impl*>(self)->page(c); }, this);
  mg_set_websocket_handler(
      context, "**",
      [](const mg_connection* c, void* self) {
        return static_cast<Impl*>(self)->connect(const_cast<mg_connection*>(c));
      },
      [](mg_connection* c, void* self) { static_cast<Impl*>(self)->add(c); },
      [](mg_connection* c, int bits, char* data, std::size_t size, void* self) {
        return static_cast<Impl*>(self)->take(c, bits, {data, size});
      },
      [](const mg_connection* c, void* self) { static_cast<Impl*>(self)->remove(c); }, this);
}

WebServer::WebServer(const WebSettings& settings, std::string setting, OnMessage on_message) {
  if (settings.needs_token() && settings.token.empty())
    throw usage_error("--web " + settings.address + ": an address that others reach needs a token");
  impl_ = std::make_unique<Impl>(settings, std::move(setting), std::move(on_message));
}

void WebServer::listen() {
  mg_init_library(0);  // without TLS: as Debian 12 builds it, it ends the program (OpenSSL 3)
  try {
    impl_->start();
  } catch (...) {
    mg_exit_library();
    throw;
  }
}

WebServer::~WebServer() {
  if (impl_->context == nullptr) return;
  // civetweb's listener looks every two seconds whether it should end; a connection wakes it up.
  std::thread wakes([port = impl_->listening_port] {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    wake(port);
  });
  mg_stop(impl_->context);
  wakes.join();
  mg_exit_library();
}

void WebServer::publish(std::shared_ptr<const std::string> frame) {
  const std::lock_guard lock(impl_->mutex);
  for (const auto& [connection, viewer] : impl_->viewers) viewer->give_frame(frame);
  impl_->newest_frame = std::move(frame);
}

void WebServer::publish_state(const std::string& json) {
  const auto state = std::make_shared<const std::string>(json);
  const std::lock_guard lock(impl_->mutex);
  for (const auto& [connection, viewer] : impl_->viewers) viewer->give_text(state);
  impl_->newest_state = state;
}

int WebServer::viewers() const {
  const std::lock_guard lock(impl_->mutex);
  return static_cast<int>(impl_->viewers.size());
}

int WebServer::port() const { return impl_->listening_port; }

std::string WebServer::url() const {
  const WebSettings& s = impl_->settings;
  const std::string host = s.address == "0.0.0.0" ? "THIS-COMPUTER" : s.address;
  return (s.name.empty() ? "http://" + host + ":" + std::to_string(port()) : "https://" + s.name) + "/" +
         (s.token.empty() ? "" : "#token=" + s.token);
}

}  // namespace tactus
