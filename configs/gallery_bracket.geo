// An L-shaped bracket with a fillet and a bolt hole; gmsh -2 -order 2 gallery_bracket.geo -o gallery_bracket.msh
Mesh.MeshSizeMax = 0.5; Mesh.MeshSizeFromCurvature = 16;
Point(1) = {0, 0, 0}; Point(2) = {10, 0, 0}; Point(3) = {10, 2, 0}; Point(4) = {4, 2, 0}; Point(5) = {4, 4, 0};
Point(6) = {2, 4, 0}; Point(7) = {2, 10, 0}; Point(8) = {0, 10, 0};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Circle(4) = {4, 5, 6}; Line(5) = {6, 7}; Line(6) = {7, 8}; Line(7) = {8, 1};
Point(10) = {7.5, 1, 0};
Point(11) = {8, 1, 0}; Point(12) = {7.5, 1.5, 0}; Point(13) = {7, 1, 0}; Point(14) = {7.5, 0.5, 0};
Circle(11) = {11, 10, 12}; Circle(12) = {12, 10, 13}; Circle(13) = {13, 10, 14}; Circle(14) = {14, 10, 11};
Curve Loop(1) = {1 : 7}; Curve Loop(2) = {11 : 14};
Plane Surface(1) = {1, 2};
Physical Curve("foot") = {1};
Physical Curve("free") = {2, 3, 4, 5, 6};
Physical Curve("back") = {7};
Physical Curve("bolt") = {11 : 14};
Physical Surface("bracket") = {1};
