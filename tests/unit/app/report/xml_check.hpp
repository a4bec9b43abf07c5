#pragma once
#include <algorithm>
#include <cctype>
#include <string>
#include <string_view>
#include <vector>

namespace vergence::test {

/// Whether a document is well-formed: elements nested and closed, attributes quoted and not twice,
/// entities known, no stray markup. Empty when it is, else what is wrong and where. A doctype at
/// the front is passed over; comments and CDATA are not expected.
class XmlCheck {
 public:
  [[nodiscard]] static std::string problem(std::string_view text) {
    XmlCheck check(text);
    check.document();
    return check.problem_;
  }

 private:
  explicit XmlCheck(std::string_view text) : text_(text) {}

  void document() {
    if (text_.starts_with("<!DOCTYPE html>")) at_ = 15;
    while (at_ < text_.size() && problem_.empty()) {
      if (text_[at_] == '<')
        tag();
      else
        characters('<');
    }
    if (problem_.empty() && !open_.empty()) fail("<" + open_.back() + "> is not closed");
  }

  /// Up to the end sign; every & begins an entity.
  void characters(char end) {
    for (; at_ < text_.size() && text_[at_] != end && problem_.empty(); ++at_) {
      const char c = text_[at_];
      if (c == '&') entity();
      if (c == '<') fail("a bare <");
      if (static_cast<unsigned char>(c) < 0x20 && c != '\n' && c != '\t')
        fail("a control character");
    }
  }
  void entity() {
    for (const std::string_view known : {"&amp;", "&lt;", "&gt;", "&quot;", "&#39;"})
      if (text_.substr(at_).starts_with(known)) return;
    fail("an unknown entity");
  }

  std::string name() {
    const std::size_t begin = at_;
    while (at_ < text_.size() && (std::isalnum(static_cast<unsigned char>(text_[at_])) != 0 ||
                                  text_[at_] == '-' || text_[at_] == ':'))
      ++at_;
    if (at_ == begin) fail("a name is missing");
    return std::string(text_.substr(begin, at_ - begin));
  }

  void tag() {
    ++at_;
    const bool closing = at_ < text_.size() && text_[at_] == '/';
    if (closing) ++at_;
    const std::string element = name();
    std::vector<std::string> seen;
    while (problem_.empty() && at_ < text_.size() && text_[at_] == ' ') attribute(&seen);
    const bool empty = at_ < text_.size() && text_[at_] == '/';
    if (empty) ++at_;
    if (at_ >= text_.size() || text_[at_] != '>') return fail("<" + element + " does not end");
    ++at_;
    if (closing) {
      if (open_.empty() || open_.back() != element)
        return fail("</" + element + "> closes nothing");
      open_.pop_back();
    } else if (!empty) {
      open_.push_back(element);
    }
  }

  void attribute(std::vector<std::string>* seen) {
    ++at_;
    const std::string key = name();
    if (std::find(seen->begin(), seen->end(), key) != seen->end())
      return fail("attribute " + key + " twice");
    seen->push_back(key);
    if (text_.substr(at_, 2) != "=\"") return fail("attribute " + key + " has no quoted value");
    at_ += 2;
    characters('"');
    ++at_;
  }

  void fail(const std::string& what) {
    if (problem_.empty())
      problem_ = what + " near: " + std::string(text_.substr(at_ < 60 ? 0 : at_ - 60, 120));
  }

  std::string_view text_;
  std::size_t at_ = 0;
  std::vector<std::string> open_{};
  std::string problem_{};
};

}  // namespace vergence::test
