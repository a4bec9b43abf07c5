#pragma once
#include "app/publish/http_server.hpp"
#include "app/session/session_observer.hpp"
#include "core/types/image.hpp"

namespace vergence::app {

/// A grey JPEG of the image, at most kThumbnailWidth pixels wide; empty for an empty image.
[[nodiscard]] std::string thumbnail(const ImageView& image);
inline constexpr int kThumbnailWidth = 480;

/// Encoding of RFC 4648.
[[nodiscard]] std::string base64(std::string_view bytes);

/// The live page as an observer of a session. Throws InputError as HttpServer does.
[[nodiscard]] std::unique_ptr<SessionObserver> make_live_page(const HostPort& address,
                                                              const HttpPolicy& policy,
                                                              SessionRequests* requests);

/// The live page: HTML, style sheet and script in one, from app/publish/page/. Lives as long as
/// the program.
[[nodiscard]] std::string_view page_html();

}  // namespace vergence::app
