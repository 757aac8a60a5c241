// SPDX-License-Identifier: Apache-2.0
#include "map_builder/view_board.h"

#include <algorithm>

#include "map_builder/stream_texts.h"

namespace ignis {

bool ViewBoard::apply(ViewUpdate update) {
  const auto take = [](auto& newest, auto& news) {
    if (news) newest = std::move(news);
  };
  take(hud_, update.hud);
  take(loops_, update.loops);
  take(api_status_, update.api_status);
  take(keyframes_, update.keyframes);
  session_ = update.session.value_or(session_);
  revision_ = update.revision.value_or(revision_);
  for (SharedBytes& event : update.events) {
    events_.push_back(std::move(event));
    if (events_.size() > kMaxEvents) events_.pop_front();
    ++events_ever_;
  }
  if (update.pictures.empty()) return false;
  pictures_ = std::move(update.pictures);
  return true;
}

std::vector<SharedBytes> ViewBoard::take_texts(Seen& seen) const {
  std::vector<SharedBytes> texts;
  const std::int64_t unseen = std::min(events_ever_ - seen.events, static_cast<std::int64_t>(events_.size()));
  texts.insert(texts.end(), events_.end() - unseen, events_.end());
  seen.events = events_ever_;
  if (keyframes_ && seen.keyframes != keyframes_) {
    if (auto text = keyframes_text(seen.keyframes.get(), *keyframes_)) {
      texts.push_back(std::make_shared<const std::string>(std::move(*text)));
    }
    seen.keyframes = keyframes_;
  }
  if (loops_ && std::exchange(seen.loops, loops_) != loops_) texts.push_back(loops_);
  if (hud_ && std::exchange(seen.hud, hud_) != hud_) texts.push_back(hud_);
  return texts;
}

SharedPicture ViewBoard::picture(double radius_m) const {
  const auto found = pictures_.find(radius_m);
  return found == pictures_.end() ? nullptr : found->second;
}

}  // namespace ignis
