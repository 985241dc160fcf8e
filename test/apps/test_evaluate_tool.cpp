// SPDX-License-Identifier: BSD-3-Clause
// pcl_mrf_evaluate as users run it: its files and its errors.
#include "support/mesh_reader.h"
#include "support/tool.h"

#include <regex>

namespace {

class EvaluateTool : public tool::Test {
protected:
  EvaluateTool() : Test(MRF_EVALUATE_TOOL)
  {
    write("flat.off", "OFF\n4 2 0\n0 0 0\n3 0 0\n3 4 0\n0 4 0\n3 0 1 2\n3 0 2 3\n");
    write("above.off", "OFF\n4 2 0\n0 0 .5\n3 0 .5\n3 4 .5\n0 4 .5\n3 0 1 2\n3 0 2 3\n");
    write("cloud.xyz", "1 1 .25\n2 2 -.25\n");
  }
};

/// A mesh of two triangles at z = 0 with the given sigma and with one corner in a filling.
std::string withSigma(const std::string& sigma)
{
  return "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
         "property float confidence\nproperty float sigma\nelement face 2\nproperty list uchar int vertex_indices\n"
         "end_header\n0 0 0 1 " +
         sigma + "\n3 0 0 1 .2\n3 4 0 1 1\n0 4 0 0 .5\n3 0 1 2\n3 0 2 3\n";
}

TEST_F(EvaluateTool, TellsWhetherSigmaIsRight)
{
  write("sigma.ply", withSigma(".4"));
  const tool::Outcome outcome = succeed({"sigma.ply", "--sigma", "--reference", "above.off", "--json", "r.json"});
  EXPECT_NE(outcome.out.find("measured"), std::string::npos) << outcome.out;
  const nlohmann::json json = parsed("r.json")["sigma"];
  // All are off by .5: 1.25, 2.5 and .5 sigma, at corners with 2/6, 1/6 and 2/6 of the area.
  EXPECT_EQ(json["measured"]["count"], 3);
  EXPECT_NEAR(json["measured"]["coverage"][0].get<double>(), .4, 1e-6);
  EXPECT_NEAR(json["measured"]["coverage"][1].get<double>(), .8, 1e-6);
  EXPECT_NEAR(json["measured"]["coverage"][2].get<double>(), .8, 1e-6);
  EXPECT_NEAR(json["measured"]["rmsError"].get<double>(), .5, 1e-6);
  EXPECT_NEAR(json["measured"]["medianHalfWidth"].get<double>(), 1.96 * .4, 1e-4);
  EXPECT_EQ(json["fillings"]["count"], 1);
  EXPECT_EQ(json["fillings"]["coverage"], nlohmann::json({0, 1, 1}));
  EXPECT_EQ(json["notKnown"], 0);

  // A withheld point 1.37 sigma away, or 1.1 of sigma and noise: 3, 4, 5 in tenths.
  write("withheld.xyz", ".9 .1 .55\n");
  for (const bool isNoisy : {false, true}) {
    const std::string noise = isNoisy ? "--noise=.3" : "-q";
    succeed({"sigma.ply", "--sigma", "--held-out", "withheld.xyz", "--json", "r.json", noise});
    EXPECT_EQ(parsed("r.json")["sigma"]["measured"]["coverage"],
              isNoisy ? nlohmann::json({0, 1, 1}) : nlohmann::json({0, 0, 1}));
  }
  write("sigma.ply", withSigma("nan"));
  succeed({"sigma.ply", "--sigma", "--reference", "above.off", "--json", "r.json"});
  EXPECT_EQ(parsed("r.json")["sigma"]["notKnown"], 1);
}

TEST_F(EvaluateTool, SigmaNeedsAFieldAndSomethingToCompareWith)
{
  write("sigma.ply", withSigma(".4"));
  expectFailure({"sigma.ply", "--sigma"}, 2, "--sigma needs something to compare with");
  expectFailure({"flat.off", "--sigma", "--reference", "above.off"}, 2, "ply");
  expectFailure({"sigma.ply", "--sigma", "--reference", "above.off", "--noise", "1"}, 2, "--noise is of the points of");
  write("plain.ply", std::regex_replace(withSigma(".4"), std::regex("float sigma"), "float other"));
  expectFailure({"plain.ply", "--sigma", "--reference", "above.off"}, 1, "no field `sigma`");
}

TEST_F(EvaluateTool, TableJsonAndColors)
{
  const tool::Outcome outcome = succeed({"flat.off", "--input", "cloud.xyz", "--held-out", "cloud.xyz", "--reference",
                                         "above.off", "--json", "r.json", "--colored", "c.ply", "--samples", "1000"});
  EXPECT_EQ(outcome.err, "");
  for (const char* words : {"cloudPercent", "heldOut", "meshToReference", "inventedShare", "nonManifoldEdges", "rms"})
    EXPECT_NE(outcome.out.find(words), std::string::npos) << words;
  for (const std::string& line : tool::linesOf(outcome.out))
    EXPECT_LE(line.size(), 104u) << line;

  const nlohmann::json json = parsed("r.json");
  EXPECT_EQ(json["files"]["mesh"], "flat.off");
  EXPECT_EQ(json["diagonal"], 5);
  EXPECT_EQ(json["diagonalSource"], "reference");
  EXPECT_EQ(json["samples"], 1000);
  EXPECT_EQ(json["distances"]["cloud"]["rms"], .25);
  EXPECT_EQ(json["distances"]["heldOut"]["count"], 2);
  EXPECT_EQ(json["distances"]["cloudPercent"]["rms"], 5);
  EXPECT_EQ(json["distances"]["meshToReference"]["max"], .5);
  EXPECT_EQ(json["reference"]["inventedShare"], 1);
  EXPECT_EQ(json["mesh"]["boundaryLoops"], 1);
  EXPECT_EQ(json["mesh"]["selfIntersectingTriangles"], 0);
  EXPECT_EQ(json["mesh"]["eulerCharacteristic"], 1);

  const std::string colored = tool::readText(path("c.ply"));
  EXPECT_NE(colored.find("property uchar red"), std::string::npos);
  EXPECT_EQ(mrf_apps::readMesh(path("c.ply").string()).scalars.at("error").size(), 4u);
}

TEST_F(EvaluateTool, TellsOfPointsWithoutACoordinate)
{
  write("gaps.csv", "x,y,z\n1,1,.1\n2,NA,.1\n2,2,.1\n");
  EXPECT_EQ(succeed({"flat.off", "--held-out", "gaps.csv"}).err,
            "warning: 'gaps.csv': 1 point has no number as a coordinate, in line 3: left out\n");
}

TEST_F(EvaluateTool, WhatASensorSees)
{
  const auto seen = [&](const std::vector<std::string>& arguments) {
    const tool::Outcome outcome = succeed(tool::with(
        arguments, {"--sensor", "1.5,2,5", "--sensor-axis", "0,0,-1", "--json", "r.json", "--samples", "20000"}));
    EXPECT_NE(outcome.out.find("inFrontShare"), std::string::npos);
    return nlohmann::json(parsed("r.json")["sensor"]);
  };
  // The mesh is .5 behind the truth, and as wide: lines of sight to the outer tenth of the truth pass it by. Samples
  // are in strata of the area, so that a share of it is known to some 1e-3.
  nlohmann::json json = seen({"flat.off", "--reference", "above.off", "--far", ".6"});
  EXPECT_NEAR(json["missingShare"].get<double>(), .19, .004);
  EXPECT_EQ(json["inFrontShare"], 0);
  EXPECT_NEAR(json["rms"].get<double>(), .5, 1e-9);
  EXPECT_NEAR(json["rmsInLimits"].get<double>(), .5 / .6, 1e-9);
  EXPECT_NEAR(json["medianNormalError"].get<double>(), 0, 1e-9);
  EXPECT_EQ(json["flippedShare"], 0);
  EXPECT_NEAR(json["areaRatio"].get<double>(), 1 / .81, .006);
  // The limit grows: .1 + .02 · 4.5², of the truth's depth.
  json = seen({"flat.off", "--reference", "above.off", "--far", ".1", "--far-growth", ".02"});
  EXPECT_NEAR(json["rmsInLimits"].get<double>(), .5 / .505, 1e-9);
  EXPECT_EQ(seen({"flat.off", "--reference", "above.off", "--far", ".1", "--far-growth", ".019"})["missingShare"], 1);
  // In front: the mesh is seen instead, in its inner part before truth.
  json = seen({"above.off", "--reference", "flat.off", "--far", ".1"});
  EXPECT_EQ(json["inFrontShare"], 1);
  EXPECT_NEAR(json["inFrontAreaShare"].get<double>(), .81, .004);
  EXPECT_EQ(json["missingShare"], 0);

  // Turned over; and the truth's own normals count where it has any: here tilted by 45 degrees.
  write("turned.off", "OFF\n4 2 0\n0 0 0\n3 0 0\n3 4 0\n0 4 0\n3 0 2 1\n3 0 3 2\n");
  EXPECT_EQ(seen({"turned.off", "--reference", "flat.off"})["flippedShare"], 1);
  write("tilted.ply", "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
                      "property float nx\nproperty float ny\nproperty float nz\nelement face 1\n"
                      "property list uchar int vertex_indices\nend_header\n"
                      "0 0 0 1 0 1\n3 0 0 1 0 1\n3 4 0 1 0 1\n3 0 1 2\n");
  json = seen({"flat.off", "--reference", "tilted.ply"});
  EXPECT_NEAR(json["medianNormalError"].get<double>(), 45, 1e-4);

  expectFailure({"flat.off", "--sensor", "0,0,5"}, 2, "--sensor needs a --reference");
  expectFailure({"flat.off", "--reference", "above.off", "--far-growth", "1"}, 2, "need a --sensor");
  expectFailure({"flat.off", "--reference", "above.off", "--sensor", "0,5"}, 2, "--sensor");
  expectFailure({"flat.off", "--reference", "above.off", "--sensor", "0,0,5", "--sensor-axis", "0,0,1"}, 1,
                "see nothing");
}

TEST_F(EvaluateTool, OptionsAndRepetition)
{
  const auto json = [&](const std::vector<std::string>& arguments) {
    EXPECT_EQ(succeed(tool::with(arguments, {"--json", "r.json", "-q"})).out, "") << "-q prints errors only";
    return parsed("r.json");
  };
  const nlohmann::json wide = json({"flat.off", "--reference", "above.off", "--far", ".6", "--diagonal", "10"});
  EXPECT_EQ(wide["diagonalSource"], "given");
  EXPECT_EQ(wide["reference"]["inventedShare"], 0);
  EXPECT_EQ(wide["distances"]["referenceToMeshPercent"]["rms"], 5);
  EXPECT_EQ(json({"flat.off", "--reference", "above.off", "--threads", "1"}),
            json({"flat.off", "--reference", "above.off", "--threads", "4"}));
}

TEST_F(EvaluateTool, WrongUsage)
{
  expectFailure({}, 2, "MESH");
  expectFailure({"flat.xyz"}, 2, "does not end in");
  expectFailure({"flat.off", "--reference", "cloud.xyz"}, 2, "--reference");
  expectFailure({"flat.off", "--input", "flat.stl"}, 2, "flat.stl");
  expectFailure({"flat.off", "--input", ""}, 2, "--input");
  expectFailure({"flat.off", "--colored", "c.stl", "--input", "cloud.xyz"}, 2, "STL");
  expectFailure({"flat.off", "--colored", "c.ply"}, 2, "--reference");
  for (const char* option : {"--diagonal", "--far"})
    for (const char* value : {"-1", "nan", "inf", "x"})
      expectFailure({"flat.off", option, value, "--json", "r.json"}, 2, "");
  expectFailure({"flat.off", "--samples", "0"}, 2, "samples");
  expectFailure({"flat.off", "--samples", "1e20"}, 2, "samples");
  write("flat.ply", "");
  expectFailure({"flat.ply", "--input", "cloud.xyz", "--colored", "flat.ply"}, 2, "would be overwritten");
}

TEST_F(EvaluateTool, WrongInput)
{
  expectFailure({"nowhere.off", "--json", "r.json"}, 1, "'nowhere.off': No such file or directory");
  expectFailure({"flat.off", "--input", "nowhere.xyz", "--json", "r.json"}, 1, "nowhere.xyz");
  expectFailure({"flat.off", "--reference", "nowhere.off", "--json", "r.json"}, 1, "nowhere.off");
  expectFailure({"flat.off", "--json", "nowhere/r.json"}, 1, "nowhere/r.json");
  write("empty.off", "OFF\n0 0 0\n");
  write("line.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n2 0 0\n3 0 1 2\n");
  write("nan.xyz", "nan nan nan\n");
  expectFailure({"empty.off", "--json", "r.json"}, 1, "holds no triangles");
  expectFailure({"line.off", "--json", "r.json"}, 1, "'line.off': has no triangle with an area");
  expectFailure({"flat.off", "--reference", "line.off", "--json", "r.json"}, 1, "'line.off': has no triangle");
  expectFailure({"flat.off", "--input", "nan.xyz", "--json", "r.json"}, 1, "'nan.xyz': has no finite point");
}

} // namespace
