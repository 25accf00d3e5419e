#include "tactus/base/error.h"
#include "tactus/web/web_server.h"

namespace tactus {

std::string web_missing() { return "civetweb (libcivetweb-dev; tools/install_deps.sh web): no --web"; }

struct WebServer::Impl {};

WebServer::WebServer(const WebSettings& /*settings*/, std::string /*setting*/, OnMessage /*on_message*/) {}
void WebServer::listen() {
  throw Error("--web needs a library that this program was built without: " + web_missing());
}
WebServer::~WebServer() = default;
void WebServer::publish(std::shared_ptr<const std::string> /*frame*/) {}
void WebServer::publish_state(const std::string& /*json*/) {}
int WebServer::viewers() const { return 0; }
int WebServer::port() const { return 0; }
std::string WebServer::url() const { return ""; }

}  // namespace tactus
