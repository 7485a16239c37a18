% Makes the MAT-files of this folder with GNU Octave from measurement.csv (17 digits), which lies beside them:
%     octave-cli --no-init-file make.m
% octave_v7.mat: what a test bench saves; octave_v6.mat: in a struct, with a cell and a text beside it;
% octave_text.mat: Octave's own text format, which bears the same suffix by default.
table = dlmread ("measurement.csv", ",", 1, 0);
t = table(:,1); M1 = table(:,2); M2 = table(:,3); theta1 = table(:,4); theta2 = table(:,5);
y1 = table(:,6); y2 = table(:,7);
save ("-v7", "octave_v7.mat", "t", "M1", "M2", "theta1", "theta2", "y1", "y2");
bench.rig = "test rig";
bench.fs = 2048;
bench.torque_driver = M1(1:64);
bench.labels = {"a", "b"};
save ("-v6", "octave_v6.mat", "bench");
save ("-text", "octave_text.mat", "bench");
% crash.mat is not of Octave: a MAT-file by SciPy with some bytes changed at random, which crashes SciPy's reader.
