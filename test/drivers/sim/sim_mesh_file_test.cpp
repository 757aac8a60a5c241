// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/mesh_file.h"

#include "drivers/sim/scene_files.h"

namespace ignis::sim {
namespace {

class MeshFiles : public test::SceneFolder {
 protected:
  /// What the scene that places the file says about it.
  std::string error_of_mesh(const std::string& name) {
    return error_of(write("scene.json", R"({"meshes": [{"file": ")" + name + R"("}]})"));
  }
};

constexpr const char* kPlyHead =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n";

TEST_F(MeshFiles, PlyAndObjOfTheSameSurfaceAgree) {
  // A quadrangle and a triangle: polygons are split.
  const TriangleMesh ply =
      load_mesh(write("roof.ply",
                      "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\n"
                      "property float z\nelement face 2\nproperty list uchar int vertex_indices\n"
                      "end_header\n0 0 0\n2 0 0\n2 1 0\n0 1 0\n1 2 0.5\n4 0 1 2 3\n3 3 2 4\n"));
  const TriangleMesh obj =
      load_mesh(write("roof.obj", "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nv 1 2 0.5\nf 1 2 3 4\nf 4 3 5\n"));
  EXPECT_EQ(ply.triangles.size(), 3U);
  EXPECT_EQ(obj.triangles.size(), 3U);
  const RayScene ply_scene({}, {}, {ply});
  const RayScene obj_scene({}, {}, {obj});
  int hits = 0;
  for (double x = -0.45; x < 2.5; x += 0.1) {
    for (double y = -0.45; y < 2.5; y += 0.1) {
      const Ray ray{{x, y, 5.0}, {0, 0, -1}};
      const std::optional<Hit> a = ply_scene.cast(ray, 20.0);
      const std::optional<Hit> b = obj_scene.cast(ray, 20.0);
      ASSERT_EQ(a.has_value(), b.has_value()) << x << ' ' << y;
      if (!a) continue;
      ++hits;
      EXPECT_NEAR(a->distance, b->distance, 1e-6);
      EXPECT_NEAR(a->normal.dot(b->normal), 1.0, 1e-6);
    }
  }
  EXPECT_NEAR(hits, 300, 30) << "the area is 3 m^2, a hundred rays to each";
}

TEST_F(MeshFiles, AreScaledThenTurnedThenMoved) {
  // One triangle whose corners tell the axes apart, in millimetres, with Z up.
  write("axes.ply", std::string(kPlyHead) + "1000 0 0\n0 2000 0\n0 0 3000\n0 0 0\n3 0 1 2\n");
  const SceneConfig scene = load_scene(write("scene.json", R"({"meshes": [{"file": "axes.ply", "scale": 0.001,
      "pitch_deg": -90, "yaw_deg": 90, "translation_m": [10, 20, 30], "reflectivity": 0.25}]})"));
  const TriangleMesh& mesh = scene.meshes[0].mesh;
  const auto corner = [&](std::size_t i) { return mesh.vertices[mesh.triangles[0][i]]; };
  // Z up became Y up; the turn to the left takes +X to -Z and -Z (the file's +Y) to -X.
  EXPECT_LT((corner(0) - Eigen::Vector3f(10, 20, 29)).norm(), 1e-5F);
  EXPECT_LT((corner(1) - Eigen::Vector3f(8, 20, 30)).norm(), 1e-5F);
  EXPECT_LT((corner(2) - Eigen::Vector3f(10, 23, 30)).norm(), 1e-5F);
  EXPECT_EQ(make_ray_scene(scene).meshes()[0].reflectivity, 0.25);
}

TEST_F(MeshFiles, AreTakenOverWithTheGeometry) {
  write("one.ply", std::string(kPlyHead) + "0 0 0\n1 0 0\n0 1 0\n0 0 0\n3 0 1 2\n");
  write("hall.json", R"({"meshes": [{"file": "one.ply"}]})");
  EXPECT_EQ(load_scene(write("drive.json", R"({"geometry": "hall.json"})")).meshes.size(), 1U);
}

TEST_F(MeshFiles, AnUnusableOneIsRefusedWithItsFieldItsNameAndTheReason) {
  write("points.ply",
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 "
        "0 0\n");
  write("nan.ply", std::string(kPlyHead) + "0 0 0\n1 nan 0\n0 1 0\n0 0 0\n3 0 1 2\n");
  write("index.ply", std::string(kPlyHead) + "0 0 0\n1 0 0\n0 1 0\n0 0 0\n3 0 1 7\n");
  write("index.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n");
  write("garbage.ply", "this is no mesh");
  write("mesh.xyz", "0 0 0");
  for (const auto& [file, reason] : {std::pair{"nowhere.ply", "no such file"},
                                     {"points.ply", ""},
                                     {"nan.ply", "not a number"},
                                     {"index.ply", ""},
                                     {"index.obj", ""},
                                     {"garbage.ply", "cannot be read"},
                                     {"mesh.xyz", ".ply or .obj"}}) {
    const std::string error = error_of_mesh(file);
    EXPECT_NE(error.find("scene.json"), std::string::npos) << file << ": " << error;
    EXPECT_NE(error.find("meshes[0].file = \"" + std::string(file)), std::string::npos) << file << ": " << error;
    EXPECT_NE(error.find(reason), std::string::npos) << file << ": " << error;
  }
}

TEST_F(MeshFiles, EveryUnusableOneIsNamedInOneMessage) {
  const std::string error = error_of(write("scene.json", R"({"meshes": [{"file": "a.ply"}, {"file": "b.obj"}]})"));
  EXPECT_NE(error.find("meshes[0].file"), std::string::npos) << error;
  EXPECT_NE(error.find("meshes[1].file"), std::string::npos) << error;
}

}  // namespace
}  // namespace ignis::sim
