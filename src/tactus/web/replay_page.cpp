#include <array>

#include "tactus/base/base64.h"
#include "tactus/base/error.h"
#include "tactus/web/replay_bytes.h"
#include "tactus/web/replay_sink.h"
#include "tactus/web/web_files.h"

namespace tactus {
namespace {

/// Inflates the modules, gives each an address in memory, and starts the last one.
constexpr std::string_view kLoader = R"(
const inflate = async (id) => new Response(new Blob([Uint8Array.from(atob(document.getElementById(id).textContent), (c) => c.charCodeAt(0))])
  .stream().pipeThrough(new DecompressionStream('deflate'))).arrayBuffer();
const urls = new Map();
for (const name of NAMES) {
  let text = new TextDecoder().decode(await inflate(name));
  for (const [other, url] of urls) text = text.replaceAll(`'./${other}'`, `'${url}'`);
  urls.set(name, URL.createObjectURL(new Blob([text], { type: 'text/javascript' })));
}
const { start } = await import(urls.get('replay.js'));
start(await inflate('messages'));
)";
/// Each may import those before it.
constexpr std::array<std::string_view, 5> kModules{"three.js", "stream.js", "viewer.js", "panels.js",
                                                   "replay.js"};
/// Nothing is loaded from anywhere: scripts are in the file.
constexpr std::string_view kPolicy =
    "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; script-src 'unsafe-inline' "
    "blob:; style-src "
    "'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'\">\n";

std::string_view text_of(std::string_view name) {
  const WebFile* file = find_web_file(name);
  if (file == nullptr) throw Error("the page lacks '" + std::string(name) + "': " + web_page_missing());
  return file->text;
}

void replace(std::string& text, std::string_view what, const std::string& with) {
  const std::size_t at = text.find(what);
  if (at == text.npos) throw Error("index.html of the page lacks '" + std::string(what) + "'");
  text.replace(at, what.size(), with);
}

std::string data_script(std::string_view id, std::string_view bytes) {
  return "<script type=\"application/octet-stream\" id=\"" + std::string(id) + "\">" +
         base64(deflated(bytes)) + "</script>\n";
}

}  // namespace

std::string replay_page(std::string_view messages) {
  std::string page(text_of("index.html"));
  replace(page, "<link rel=\"stylesheet\" href=\"page.css\">\n",
          std::string(kPolicy) + "<style>\n" + std::string(text_of("page.css")) + "</style>\n");
  replace(page, "<script type=\"module\" src=\"live.js\"></script>\n", "");
  std::string names = "[";
  std::string scripts;
  for (const std::string_view name : kModules) {
    names += (names.size() > 1 ? ", '" : "'") + std::string(name) + "'";
    scripts += data_script(name, text_of(name));
  }
  scripts += data_script("messages", messages);
  if (const WebFile* license = find_web_file("three-license.txt"))
    scripts +=
        "<script type=\"text/plain\" id=\"three-license\">\n" + std::string(license->text) + "</script>\n";
  std::string loader(kLoader);
  replace(loader, "NAMES", names + "]");
  replace(page, "</body>", scripts + "<script type=\"module\">" + loader + "</script>\n</body>");
  return page;
}

}  // namespace tactus
