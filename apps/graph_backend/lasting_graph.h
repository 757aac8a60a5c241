// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "backend/smoother.h"
#include "journal_file.h"
#include "runtime/ignis_config.h"

namespace ignis {

/// The smoother of the present session and, when a folder is given, its journal: every change is written before it is
/// told to anybody, and a new process begins with what the last one had.
class LastingGraph {
 public:
  /// Resumes from `journal_folder`; empty: without a journal. Throws runtime::UserError when the folder cannot be used.
  LastingGraph(const runtime::IgnisConfig& config, const std::filesystem::path& journal_folder);

  /// -1 before the first one.
  [[nodiscard]] std::int32_t session() const { return session_; }
  [[nodiscard]] const Smoother& smoother() const { return smoother_; }

  /// An empty graph for the keyframes of another session or drive. The journal so far is kept under another name.
  void begin_session(std::int32_t session);

  /// Calls `work` with the smoother and writes down what it changed.
  SmootherUpdate change(const std::function<SmootherUpdate(Smoother&)>& work);

  void accept_gap_before(std::int32_t id);

  /// The graph as it is now, for a batch solve.
  [[nodiscard]] ShadowProblem shadow_problem() { return smoother_.shadow_problem(); }

  /// Keeps the journal going. Call it often.
  void maintain();

  /// What became of an earlier journal, for people; empty when there was none.
  [[nodiscard]] const std::string& resume_note() const { return resume_note_; }

  /// Why changes are not on disk; empty while all is well.
  [[nodiscard]] std::string failure() const;

 private:
  void resume();
  void put_aside(const std::string& reason);

  const runtime::IgnisConfig& config_;
  std::string fingerprint_;
  std::unique_ptr<JournalFile> journal_;
  Smoother smoother_;
  std::int32_t session_ = -1;
  std::string resume_note_;
};

}  // namespace ignis
