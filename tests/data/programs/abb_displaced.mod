MODULE displaced
  CONST robtarget p1:=[[818.7,147.3,858.2],[0,-0.97969618,0,0.20048792],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST jointtarget home:=[[0,10,15,0,50,0],[0,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveAbsJ home,v100,fine,tool0;
    PDispSet pose1;
    MoveL p1,v100,fine,tool0;
  ENDPROC
ENDMODULE
