#pragma once
/// HTTP and WebSocket for viewers of a run.
#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace tactus {

struct WebSettings {
  std::string address = "127.0.0.1";
  int port = 8090;         ///< 0: one that is free
  std::string token = {};  ///< "": none is needed, on loopback alone
  /// NAME or NAME:PORT as browsers send it, of a server in front that passes viewers on; "": there is none.
  std::string name = {};
  bool is_loopback() const { return address == "127.0.0.1"; }
  bool needs_token() const { return !is_loopback() || !name.empty(); }
};

/// "ADDR:PORT", "ADDR" or "PORT"; "" is 127.0.0.1:8090. @throws usage Error naming the flag --web.
WebSettings parse_web_address(const std::string& text);
/// Checks WebSettings::name. @throws usage Error naming the flag --web-name.
std::string parse_web_name(const std::string& text);
/// 128 random bits as 32 hexadecimal digits. @throws Error where the system gives none.
std::string make_web_token();

/// Serves the page and the stream. Each viewer has a thread of its own and a place for one message, where the
/// newest replaces older ones: a viewer that stalls never delays publish().
class WebServer {
 public:
  /// Called on a viewer's thread. @returns a text for that viewer alone, or "".
  using OnMessage = std::function<std::string(std::string_view)>;
  static constexpr int kMostViewers = 32;

  /// @param setting first message to each viewer @throws usage Error without a token where one is needed.
  WebServer(const WebSettings& settings, std::string setting, OnMessage on_message);
  ~WebServer();
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;

  /// Lets viewers in. @throws Error when it can't listen there, with the reason.
  void listen();
  /// The newest frame, for all viewers and for those that come. Never waits for a viewer.
  void publish(std::shared_ptr<const std::string> frame);
  /// JSON for all viewers and for those that come: the newest counts.
  void publish_state(const std::string& json);
  int viewers() const;
  int port() const;
  /// To open in a browser; holds the token.
  std::string url() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// "", or the missing library and its purpose: "civetweb (libcivetweb-dev): no --web".
std::string web_missing();

}  // namespace tactus
