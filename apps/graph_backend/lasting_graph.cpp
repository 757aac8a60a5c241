// SPDX-License-Identifier: Apache-2.0
#include "lasting_graph.h"

#include <chrono>
#include <format>

namespace ignis {
namespace {

/// Of the parameters that decide the graph; the others may change between two runs.
std::string graph_fingerprint(const runtime::IgnisConfig& config) {
  runtime::IgnisConfig deciding;
  deciding.backend = config.backend;
  deciding.backend.cloud_memory_mb = BackendConfig().cloud_memory_mb;  // clouds look the same from wherever they come
  deciding.frontend.loop_gates = config.frontend.loop_gates;
  return runtime::config_hash(deciding);
}

}  // namespace

LastingGraph::LastingGraph(const runtime::IgnisConfig& config, const std::filesystem::path& journal_folder)
    : config_(config),
      fingerprint_(graph_fingerprint(config)),
      journal_(journal_folder.empty() ? nullptr : std::make_unique<JournalFile>(journal_folder)),
      smoother_(config.backend, config.frontend.loop_gates, journal_.get()) {
  if (journal_) resume();
}

void LastingGraph::resume() {
  const auto began = std::chrono::steady_clock::now();
  const std::optional<LoadedJournal> loaded = journal_->load();
  if (!loaded) return;
  const JournalContents& contents = loaded->contents;
  if (!contents.is_journal) {
    put_aside(contents.damage);
    return;
  }
  const JournalHead here{kJournalVersion, fingerprint_, contents.head.session};
  if (contents.head.version != here.version) {
    put_aside(std::format("it has version {}, this build writes {}", contents.head.version, here.version));
    return;
  }
  if (contents.head != here) {
    put_aside("it was written under another configuration");
    return;
  }
  SmootherRestoration restoration =
      restore_smoother(config_.backend, config_.frontend.loop_gates, contents.payloads, journal_.get());
  if (restoration.records_used == 0 && !contents.payloads.empty()) {
    put_aside("its graph cannot be built: " + restoration.problem);
    return;
  }
  const std::size_t end = loaded->end_of(restoration.records_used);
  const bool lost_records = !restoration.problem.empty() || (!contents.damage.empty() && !contents.torn_tail);
  journal_->resume(*loaded, restoration.records_used, lost_records);
  smoother_ = std::move(restoration.smoother);
  session_ = contents.head.session;
  const SmootherStats stats = smoother_.stats();
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - began;
  resume_note_ =
      std::format("resumed {} keyframes, {} loops, revision {} of session {} from {} in {:.2f} s", stats.keyframes,
                  stats.loops_kept, smoother_.revision(), session_, journal_->path().string(), spent.count());
  if (end == loaded->bytes().size()) return;
  const std::string why = restoration.problem.empty() ? contents.damage : restoration.problem;
  resume_note_ += std::format("; its last {} bytes are left out ({}){}", loaded->bytes().size() - end, why,
                              lost_records ? "; the file as it was is kept beside it" : "");
}

void LastingGraph::put_aside(const std::string& reason) {
  const std::filesystem::path kept = journal_->set_aside();
  resume_note_ = std::format("the journal {} is not used: {}; it is kept as {}", journal_->path().string(), reason,
                             kept.filename().string());
}

void LastingGraph::begin_session(std::int32_t session) {
  session_ = session;
  smoother_ = Smoother(config_.backend, config_.frontend.loop_gates, journal_.get());
  if (journal_) journal_->begin({kJournalVersion, fingerprint_, session});
}

SmootherUpdate LastingGraph::change(const std::function<SmootherUpdate(Smoother&)>& work) {
  SmootherUpdate update = work(smoother_);
  if (journal_) journal_->append(smoother_.take_change());
  return update;
}

void LastingGraph::accept_gap_before(std::int32_t id) {
  smoother_.accept_gap_before(id);
  if (journal_) journal_->append(smoother_.take_change());
}

void LastingGraph::maintain() {
  if (journal_) journal_->maintain();
}

std::string LastingGraph::failure() const { return journal_ ? journal_->failure() : ""; }

}  // namespace ignis
